//! The thread that alone talks to the library.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::camera::{Opened, Settings, Target};
use crate::clock::HostClock;
use crate::device::Device;
use crate::library::OpenNi;
use crate::mailbox::{Kind, Letter, Mailbox};
use crate::pairing::{Paired, Pairing, Timed};
use crate::picture::{DepthUnit, Pair, Picture, Sensor};
use crate::recorder::Recorder;
use crate::{OpenniError, sys};

/// How long the library is asked to wait at a time: the time in which a stop or an unplugging is
/// heard of.
const WAIT: Duration = Duration::from_millis(100);

/// The farthest apart that colour and depth of a pair are taken, in periods of the camera. At half
/// a period each picture has a neighbour, however far the streams are out of step.
const FARTHEST: f64 = 0.4;

/// What is told of a camera.
#[derive(Debug)]
pub(crate) enum Event {
    /// The next pictures.
    Pair(Pair),
    /// Some pictures were lost; it goes on.
    Problem(OpenniError),
    /// Nothing more will come.
    Over(Result<(), OpenniError>),
}

impl Letter for Event {
    fn kind(&self) -> Kind {
        match self {
            Self::Pair(_) => Kind::Content,
            Self::Problem(_) => Kind::Problem,
            Self::Over(_) => Kind::End,
        }
    }
}

impl Letter for Result<Opened, OpenniError> {
    fn kind(&self) -> Kind {
        Kind::Content
    }
}

/// What the thread begins with.
pub(crate) struct Worker {
    pub(crate) openni: OpenNi,
    pub(crate) target: Target,
    pub(crate) settings: Settings,
    pub(crate) start: Instant,
    pub(crate) opened: Arc<Mailbox<Result<Opened, OpenniError>>>,
    pub(crate) mailbox: Arc<Mailbox<Event>>,
}

impl Timed for Picture {
    fn time(&self) -> f64 {
        self.timestamp as f64 * 1e-6
    }
}

impl Worker {
    /// Opens, tells what was opened, and hands on what comes until nobody wants it.
    pub(crate) fn run(self) {
        match self.begin() {
            Ok((device, recorder, opened)) => {
                self.opened.put(Ok(opened));
                // The recorder goes first: it completes its file from the streams.
                let mut running = Running::new(&self, recorder, device);
                let over = running.read(&self.mailbox);
                self.mailbox.put(Event::Over(over));
            }
            Err(error) => {
                self.opened.put(Err(error));
            }
        }
    }

    fn begin(&self) -> Result<(Device, Option<Recorder>, Opened), OpenniError> {
        let mut device = Device::open(&self.openni, &self.target, &self.settings)?;
        let recorder = match &self.settings.record {
            Some(path) => Some(Recorder::begin(&device, path)?),
            None => None,
        };
        device.start()?;
        let mut notes = Vec::new();
        if !self.is_recording()
            && let Err(error) = device.synchronise()
        {
            notes.push(format!("{error}; they are paired by their time stamps"));
        }
        let unit = match device.depth.mode.format {
            sys::FORMAT_DEPTH_100_UM => DepthUnit::Tenth,
            _ => DepthUnit::Millimetre,
        };
        let opened = Opened {
            uri: device.uri.clone(),
            name: device.name.clone(),
            mode: device.colour.mode,
            unit,
            field_of_view: device.field_of_view(),
            notes,
        };
        Ok((device, recorder, opened))
    }

    fn is_recording(&self) -> bool {
        matches!(self.target, Target::Recording(_))
    }
}

/// A started camera or recording.
struct Running<'a> {
    worker: &'a Worker,
    recorder: Option<Recorder>,
    device: Device,
    pairing: Pairing<Picture>,
    clock: HostClock,
    /// The last picture's index, of colour and of depth; -1 where none came yet.
    last: [i32; 2],
    heard: Instant,
}

impl<'a> Running<'a> {
    fn new(worker: &'a Worker, recorder: Option<Recorder>, device: Device) -> Self {
        let rate = f64::from(device.colour.mode.rate.max(1));
        Self {
            worker,
            recorder,
            device,
            pairing: Pairing::new(FARTHEST / rate),
            clock: HostClock::new(worker.settings.latency),
            last: [-1; 2],
            heard: Instant::now(),
        }
    }

    /// Hands on what comes; how it ended.
    fn read(&mut self, mailbox: &Mailbox<Event>) -> Result<(), OpenniError> {
        while !mailbox.is_closed() {
            if self.openni().events.is_gone(&self.device.uri) {
                self.recorder = None;
                self.device.abandon();
                return Err(OpenniError::Unplugged { uri: self.device.uri.clone() });
            }
            match self.device.next(WAIT) {
                Ok(Some(picture)) => {
                    self.heard = Instant::now();
                    self.take(picture, mailbox);
                }
                Ok(None) => {
                    if let Some(over) = self.nothing() {
                        return over;
                    }
                }
                Err(error) if error.is_passing() => {
                    self.heard = Instant::now();
                    mailbox.put(Event::Problem(error));
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn openni(&self) -> &crate::library::Inner {
        &self.worker.openni.inner
    }

    /// Finds the picture's counterpart.
    fn take(&mut self, picture: Picture, mailbox: &Mailbox<Event>) {
        let sensor = picture.sensor;
        if let Some(error) = self.skipped(&picture) {
            mailbox.put(Event::Problem(error));
        }
        self.last[slot(sensor)] = picture.index;
        match self.pairing.add(sensor, picture) {
            Paired::Waits => {}
            Paired::Pair(colour, depth) => {
                let time = self.time(&colour);
                // A camera that takes both at one moment numbers them alike.
                mailbox.put(if self.device.is_synchronised() && colour.index != depth.index {
                    let (colour, depth) = (colour.index, depth.index);
                    Event::Problem(OpenniError::OutOfStep { colour, depth, time })
                } else {
                    Event::Pair(pair(time, colour, &depth))
                });
            }
            Paired::Alone(sensor, picture) | Paired::Late(sensor, picture) => {
                let (time, within) = (self.time(&picture), self.pairing.within());
                mailbox.put(Event::Problem(OpenniError::Alone { sensor, time, within }));
            }
        }
    }

    /// When the picture was taken: of a recording on its own clock, of a camera on the host's.
    fn time(&mut self, picture: &Picture) -> f64 {
        if self.worker.is_recording() {
            return picture.time();
        }
        self.clock.taken(picture.time(), self.worker.start.elapsed().as_secs_f64())
    }

    /// Pictures of a recording that did not come; a camera may skip some.
    fn skipped(&self, picture: &Picture) -> Option<OpenniError> {
        let count = picture.index.saturating_sub(self.last[slot(picture.sensor)]).saturating_sub(1);
        let lost = self.worker.is_recording() && self.last[slot(picture.sensor)] >= 0 && count > 0;
        lost.then(|| OpenniError::Skipped { sensor: picture.sensor, count, time: picture.time() })
    }

    /// What it means that nothing came: the end, or patience.
    fn nothing(&self) -> Option<Result<(), OpenniError>> {
        let silent = self.heard.elapsed() >= self.worker.settings.deadlines.picture;
        if self.worker.is_recording() {
            let uri = &self.device.uri;
            let ended = silent || self.openni().events.has_ended(uri) || self.is_complete();
            return ended.then(|| self.end_of_recording());
        }
        let (uri, seconds) = (self.device.uri.clone(), self.heard.elapsed().as_secs_f64());
        silent.then_some(Err(OpenniError::Silent { uri, seconds }))
    }

    /// Whether as many pictures came as the recording promises.
    fn is_complete(&self) -> bool {
        [Sensor::Colour, Sensor::Depth].iter().all(|&sensor| {
            let promised = self.device.promised(sensor);
            promised > 0 && self.last[slot(sensor)] >= promised
        })
    }

    /// How it ended. A picture that waits for its counterpart is no problem: it was taken while the
    /// recorder was stopped.
    fn end_of_recording(&self) -> Result<(), OpenniError> {
        for sensor in [Sensor::Colour, Sensor::Depth] {
            let (got, promised) = (self.last[slot(sensor)].max(0), self.device.promised(sensor));
            if got < promised || promised == 0 {
                return Err(OpenniError::Truncated {
                    uri: self.device.uri.clone(),
                    sensor,
                    got,
                    promised,
                });
            }
        }
        Ok(())
    }
}

fn slot(sensor: Sensor) -> usize {
    match sensor {
        Sensor::Colour => 0,
        Sensor::Depth => 1,
    }
}

fn pair(time: f64, colour: Picture, depth: &Picture) -> Pair {
    let depth =
        depth.pixels.as_chunks::<2>().0.iter().map(|&bytes| u16::from_ne_bytes(bytes)).collect();
    Pair { time, colour: colour.pixels, depth }
}
