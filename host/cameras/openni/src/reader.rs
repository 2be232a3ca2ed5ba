//! Opening and reading of a camera or recording, on a thread of the library.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use plumb_frame::clock::SensorClocks;
use plumb_frame::pairing::{Paired, Pairing, Sensor, Taken, Timed};
use plumb_pictures::pair::Pair;

use crate::device::Device;
use crate::error::OpenniError;
use crate::library::OpenNi;
use crate::picture::{Picture, pair};
use crate::recorder::Recorder;
use crate::settings::{DepthUnit, Opened, Settings, Target};
use crate::sys;

/// Longest wait inside the library: the reaction time to a stop or an unplugging.
const WAIT: Duration = Duration::from_millis(100);

/// Largest difference between the time stamps of a pair, in periods of the camera. From half a
/// period on each picture would have a counterpart, however far the streams are out of step.
const PAIR_PERIODS: f64 = 0.4;

/// Reader of a started camera or recording.
pub(crate) struct Reader {
    /// Whether the device is a recording.
    is_recording: bool,
    /// Start of the clock that stamps live pictures.
    start: Instant,
    /// Time without a picture after which the camera is silent.
    timeout: Duration,
    /// Is dropped before the device, from whose streams it completes its file.
    recorder: Option<Recorder>,
    device: Device,
    pairing: Pairing<Taken<Picture>>,
    clocks: SensorClocks,
    /// Number of the last picture, of colour and of depth; -1 before the first one.
    last: [i32; 2],
    /// Pairs and losses that are not taken yet.
    waiting: VecDeque<Result<Pair, OpenniError>>,
}

impl Reader {
    /// Opens `target` and starts it, with its own recording where `settings` ask for it. `start` is
    /// the start of the clock that stamps live pictures. Returns its description too.
    ///
    /// # Errors
    /// Where there is no such camera, or it does not accept a setting.
    pub(crate) fn open(
        openni: &OpenNi,
        target: &Target,
        settings: &Settings,
        start: Instant,
    ) -> Result<(Self, Opened), OpenniError> {
        let mut device = Device::open(openni, target, settings)?;
        let recorder = match &settings.record {
            Some(path) => Some(Recorder::start(&device, path)?),
            None => None,
        };
        device.start()?;
        let mut notes = Vec::new();
        if !target.is_recording()
            && let Err(error) = device.synchronise()
        {
            notes.push(format!("{error}; they are paired by their time stamps"));
        }
        let rate = f64::from(device.colour.mode.rate.max(1));
        let opened = opened(&device, notes);
        let reader = Self {
            is_recording: target.is_recording(),
            start,
            timeout: settings.timeouts.picture,
            recorder,
            device,
            pairing: Pairing::new(PAIR_PERIODS / rate),
            clocks: SensorClocks::new(settings.latency),
            last: [-1; 2],
            waiting: VecDeque::new(),
        };
        Ok((reader, opened))
    }

    /// Returns the next pair, `None` at the end of a recording.
    ///
    /// # Errors
    /// Where a picture is lost ([`OpenniError::is_transient`]), the camera is unplugged or silent,
    /// a call fails, or a recording is truncated.
    pub(crate) fn next(&mut self) -> Result<Option<Pair>, OpenniError> {
        let mut last_arrival = Instant::now();
        loop {
            if let Some(next) = self.waiting.pop_front() {
                return next.map(Some);
            }
            if self.device.is_unplugged() {
                self.recorder = None;
                self.device.abandon();
                return Err(OpenniError::Unplugged { uri: self.device.uri.clone() });
            }
            match self.device.next(WAIT)? {
                Some(picture) => {
                    last_arrival = Instant::now();
                    self.on_picture(picture);
                }
                None => {
                    if let Some(over) = self.on_silence(last_arrival.elapsed()) {
                        return over.map(|()| None);
                    }
                }
            }
        }
    }

    /// Pairs the picture with its counterpart, and keeps pairs and losses.
    fn on_picture(&mut self, picture: Picture) {
        let sensor = picture.sensor;
        self.waiting.extend(self.skipped(&picture).map(Err));
        self.last[sensor.index()] = picture.index;
        let time = self.time(&picture);
        self.pairing.add(sensor, Taken { picture, time });
        while let Some(result) = self.pairing.take() {
            self.waiting.push_back(self.pair(result));
        }
    }

    /// Returns the pair, or the loss.
    fn pair(&self, result: Paired<Taken<Picture>>) -> Result<Pair, OpenniError> {
        match result {
            Paired::Pair(Taken { picture: colour, time }, Taken { picture: depth, .. }) => {
                // A synchronised camera gives both pictures of a moment the same number.
                if self.device.is_synchronised() && colour.index != depth.index {
                    let (colour, depth) = (colour.index, depth.index);
                    return Err(OpenniError::OutOfStep { colour, depth, time });
                }
                Ok(pair(time, colour, &depth))
            }
            Paired::Unpaired(sensor, Taken { time, .. }) => {
                let within = self.pairing.within();
                Err(OpenniError::Unpaired { sensor, time, within })
            }
        }
    }

    /// Returns the time of a picture that has just arrived: of a recording on its own clock, of a
    /// camera on the host's.
    fn time(&mut self, picture: &Picture) -> f64 {
        if self.is_recording {
            return picture.time();
        }
        let arrival = self.start.elapsed().as_secs_f64();
        self.clocks.taken(picture.sensor, picture.time(), arrival)
    }

    /// Returns an error where pictures of a recording are missing before this one. A camera may
    /// skip pictures.
    fn skipped(&self, picture: &Picture) -> Option<OpenniError> {
        let last = self.last[picture.sensor.index()];
        let count = picture.index.saturating_sub(last).saturating_sub(1);
        let lost = self.is_recording && last >= 0 && count > 0;
        lost.then(|| OpenniError::Skipped { sensor: picture.sensor, count, time: picture.time() })
    }

    /// Returns how the camera ended where no picture came within [`WAIT`], nor in the time
    /// `silence`; `None` where it goes on.
    fn on_silence(&self, silence: Duration) -> Option<Result<(), OpenniError>> {
        let is_silent = silence >= self.timeout;
        if self.is_recording {
            let ended = is_silent || self.device.has_ended() || self.is_complete();
            return ended.then(|| self.end_of_recording());
        }
        let (uri, seconds) = (self.device.uri.clone(), silence.as_secs_f64());
        is_silent.then_some(Err(OpenniError::Silent { uri, seconds }))
    }

    /// Returns whether as many pictures came as the recording states.
    fn is_complete(&self) -> bool {
        [Sensor::Colour, Sensor::Depth].iter().all(|&sensor| {
            let promised = self.device.promised(sensor);
            promised > 0 && self.last[sensor.index()] >= promised
        })
    }

    /// Checks that the recording is complete. A last picture without counterpart is no error: it
    /// was taken while the recorder stopped.
    fn end_of_recording(&self) -> Result<(), OpenniError> {
        for sensor in [Sensor::Colour, Sensor::Depth] {
            let (got, promised) = (self.last[sensor.index()].max(0), self.device.promised(sensor));
            if got < promised || promised == 0 {
                let uri = self.device.uri.clone();
                return Err(OpenniError::Truncated { uri, sensor, got, promised });
            }
        }
        Ok(())
    }
}

/// Returns the description of an open camera or recording.
fn opened(device: &Device, notes: Vec<String>) -> Opened {
    let unit = match device.depth.mode.format {
        sys::FORMAT_DEPTH_100_UM => DepthUnit::Tenth,
        _ => DepthUnit::Millimetre,
    };
    Opened {
        uri: device.uri.clone(),
        name: device.name.clone(),
        mode: device.colour.mode,
        unit,
        field_of_view: device.field_of_view(),
        notes,
    }
}
