//! Open camera or recording.

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

use plumb_frame::clock::SensorClocks;
use plumb_frame::pairing::{Paired, Pairing, Taken, Timed};
use plumb_pictures::pair::Pair;

use crate::aligner::{Aligner, queue, wait};
use crate::device::Device;
use crate::error::RealsenseError;
use crate::handle::{Owned, Unfinished, within};
use crate::library::{Inner, RealSense};
use crate::options::Options;
use crate::sensor::{Frame, Stream, Streams};
use crate::settings::{Intrinsics, Opened, Settings, Target};

/// Frames of both sensors that may wait to be read. The library drops the oldest of a camera.
const QUEUE: i32 = 8;

/// Longest wait inside the library: the reaction time to an unplugging.
const WAIT: Duration = Duration::from_millis(100);

/// Largest difference between the time stamps of a pair, in periods of the camera. From half a
/// period on each picture would have a counterpart, however far the streams are out of step.
const PAIR_PERIODS: f64 = 0.4;

/// Largest difference between the units of depth of a picture and of its camera, as a part.
const UNIT_TOLERANCE: f64 = 1e-4;

/// Camera or recording that delivers colour and aligned depth in pairs.
///
/// It is stopped and closed when it is dropped. A call of the library that does not return blocks
/// the caller, who reads it in a thread of its own.
pub struct Camera {
    inner: Arc<Inner>,
    // The streams stop before the device, the aligner and the queue that they use are deleted.
    streams: Streams,
    pairing: Pairing<Taken<Frame>>,
    aligner: Aligner,
    queue: Owned,
    device: Device,
    opened: Opened,
    settings: Settings,
    clocks: SensorClocks,
    /// Start of the clock that stamps live pictures.
    start: Instant,
    /// Time stamp of the first pair of a recording.
    first: Option<f64>,
    /// Clock that stamped the last frame of colour and of depth.
    domains: [Option<i32>; 2],
    last_arrival: Instant,
    ended: Option<Result<(), RealsenseError>>,
}

impl Camera {
    /// Opens `target` with `settings`, verifies them, and starts it. Returns or fails within
    /// [`Settings::open_timeout`].
    ///
    /// # Errors
    /// Where there is no such camera or recording, it does not have the mode or does not accept a
    /// setting, or it states no unit of depth; where the library does not return.
    pub fn open(
        library: &RealSense,
        target: &Target,
        settings: Settings,
    ) -> Result<Self, RealsenseError> {
        let limit = settings.open_timeout;
        let (inner, wanted) = (Arc::clone(&library.inner), target.clone());
        let opened = within(limit, move || Self::open_here(&inner, &wanted, settings));
        let id = target.to_string();
        opened.unwrap_or_else(|unfinished| {
            Err(match unfinished {
                Unfinished::Thread(error) => RealsenseError::Open { id, error: error.to_string() },
                Unfinished::Late => RealsenseError::Hangs { id, seconds: limit.as_secs_f64() },
            })
        })
    }

    /// Opens the camera in this thread.
    fn open_here(
        inner: &Arc<Inner>,
        target: &Target,
        settings: Settings,
    ) -> Result<Self, RealsenseError> {
        let device = Device::open(inner, target, settings.record.as_deref())?;
        let id = device.id.clone();
        let failed = |error| RealsenseError::Open { id: id.clone(), error };
        let sensors = device.sensors().ok_or_else(|| failed("it is closed".to_owned()))?;
        let wanted = (!device.is_recording()).then_some(settings.mode);
        let streams = Streams::find(inner, sensors, &id, wanted)?;
        let options = |stream| Options { inner, sensor: Stream::handle(stream), id: &id };
        if wanted.is_some() {
            options(&streams.colour).set_exposure(&settings, streams.exposure_unit())?;
            if let Some(on) = settings.emitter {
                options(&streams.depth).set_emitter(on)?;
            }
        }
        let depth_unit = options(&streams.depth).depth_unit()?;
        let intrinsics = Intrinsics::of(&streams.colour.intrinsics(inner).map_err(failed)?);
        let (mode, name) = (streams.colour.mode(), device.name.clone());
        let opened = Opened { id: id.clone(), name, mode, depth_unit, intrinsics };
        let mut camera = Self {
            inner: Arc::clone(inner),
            streams,
            pairing: Pairing::new(PAIR_PERIODS / f64::from(mode.rate)),
            aligner: Aligner::new(inner).map_err(failed)?,
            queue: queue(inner, QUEUE).map_err(failed)?,
            device,
            opened,
            clocks: SensorClocks::new(settings.latency),
            settings,
            start: Instant::now(),
            first: None,
            domains: [None; 2],
            last_arrival: Instant::now(),
            ended: None,
        };
        // A camera that does not start is dropped in the order of its fields.
        camera.start_streams().map_err(failed)?;
        Ok(camera)
    }

    /// Starts the streams, a recording from its beginning.
    fn start_streams(&mut self) -> Result<(), String> {
        self.streams.start(&self.queue)?;
        if self.device.is_recording() {
            self.device.rewind(|| drain(&self.inner, &self.queue, WAIT))?;
        }
        Ok(())
    }

    /// Returns the description of the camera.
    pub fn opened(&self) -> &Opened {
        &self.opened
    }

    /// Returns the time on the clock of live pictures, seconds.
    pub fn now(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Returns the start of the clock of live pictures.
    pub fn start(&self) -> Instant {
        self.start
    }

    /// Returns the next pair, `None` at the end of a recording. Returns or fails within
    /// [`Settings::timeout`] and the time of one alignment.
    ///
    /// # Errors
    /// Where a picture is lost ([`RealsenseError::is_transient`]); the next one may come. Any other
    /// error is final, and every further call returns it again.
    pub fn next_pair(&mut self) -> Result<Option<Pair>, RealsenseError> {
        if let Some(ended) = &self.ended {
            return ended.clone().map(|()| None);
        }
        let result = self.read();
        match &result {
            Ok(None) => self.ended = Some(Ok(())),
            Err(error) if !error.is_transient() => self.ended = Some(Err(error.clone())),
            Ok(Some(_)) | Err(_) => {}
        }
        result
    }

    /// Reads frames until a pair is complete, a picture is lost or the camera is over.
    fn read(&mut self) -> Result<Option<Pair>, RealsenseError> {
        loop {
            if let Some(result) = self.pairing.take() {
                return self.on_result(result).map(Some);
            }
            let frame = wait(&self.inner, &self.queue, WAIT);
            let Some(frame) = frame.map_err(|error| self.failed("waiting", error))? else {
                match self.on_silence() {
                    Some(over) => return over.map(|()| None),
                    None => continue,
                }
            };
            self.last_arrival = Instant::now();
            let arrival = self.now();
            let frame = Frame::new(&self.inner, frame.into_raw());
            let Some(frame) = frame.map_err(|error| self.failed("reading a frame", error))? else {
                continue;
            };
            self.add(frame, arrival)?;
        }
    }

    /// Adds a frame that came at `arrival` to those that are paired.
    fn add(&mut self, frame: Frame, arrival: f64) -> Result<(), RealsenseError> {
        let sensor = frame.sensor;
        self.domains[sensor.index()] = Some(frame.domain);
        if let [Some(colour), Some(depth)] = self.domains
            && colour != depth
        {
            return Err(RealsenseError::Clocks);
        }
        let stamp = frame.time();
        let is_live = !self.device.is_recording();
        let time = if is_live { self.clocks.taken(sensor, stamp, arrival) } else { stamp };
        self.pairing.add(sensor, Taken { picture: frame, time });
        Ok(())
    }

    /// Returns the pair, or the error about a picture without a counterpart.
    fn on_result(&mut self, result: Paired<Taken<Frame>>) -> Result<Pair, RealsenseError> {
        match result {
            Paired::Pair(colour, depth) => self.join(colour, depth.picture),
            Paired::Unpaired(sensor, frame) => {
                let (time, within) = (self.time(frame.time), self.pairing.within());
                Err(RealsenseError::Unpaired { sensor, time, within })
            }
        }
    }

    /// Joins two frames of one moment.
    fn join(&mut self, colour: Taken<Frame>, depth: Frame) -> Result<Pair, RealsenseError> {
        let (mode, expected) = (self.opened.mode, self.opened.depth_unit);
        let (time, colour) = (self.time(colour.time), colour.picture);
        let unit = depth.depth_unit().map_err(|error| self.failed("the unit of depth", error))?;
        if (unit - expected).abs() > UNIT_TOLERANCE * expected {
            return Err(RealsenseError::OtherDepthUnit { unit, expected });
        }
        let pixels = colour.pixels(mode, 3)?;
        let aligned = self.aligner.align(colour, depth);
        let aligned = aligned.map_err(|error| self.failed("aligning depth to colour", error))?;
        let bytes = aligned.pixels(mode, 2)?;
        let depth = bytes.as_chunks::<2>().0.iter().map(|&bytes| u16::from_ne_bytes(bytes));
        Ok(Pair { time, colour: pixels, depth: depth.collect() })
    }

    /// Returns the `time` of a frame. That of a recorded frame becomes relative to the first pair.
    fn time(&mut self, time: f64) -> f64 {
        if self.device.is_recording() { time - *self.first.get_or_insert(time) } else { time }
    }

    /// Returns how the camera ended where no frame came within [`WAIT`]; `None` where it goes on.
    fn on_silence(&self) -> Option<Result<(), RealsenseError>> {
        let id = || self.opened.id.clone();
        if self.device.is_recording() {
            if self.device.has_ended() {
                return Some(Ok(()));
            }
        } else if !self.device.is_connected() {
            return Some(Err(RealsenseError::Unplugged { id: id() }));
        }
        let silence = self.last_arrival.elapsed();
        let seconds = silence.as_secs_f64();
        let is_silent = silence >= self.settings.timeout;
        is_silent.then(|| Err(RealsenseError::Silent { id: id(), seconds }))
    }

    fn failed(&self, what: &'static str, error: String) -> RealsenseError {
        RealsenseError::Read { id: self.opened.id.clone(), what, error }
    }
}

/// Removes the frames that are in `queue`, and those that come to it within `time` of each other.
fn drain(inner: &Inner, queue: &Owned, time: Duration) {
    while let Ok(Some(_)) = wait(inner, queue, time) {}
}

impl Drop for Camera {
    fn drop(&mut self) {
        // A playback that waits for room in the queue does not stop.
        if self.device.is_recording() {
            // There is no one to report an error to.
            let _ = self.device.set_waiting(false);
            drain(&self.inner, &self.queue, Duration::ZERO);
        }
    }
}

impl fmt::Debug for Camera {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Camera").field("opened", &self.opened).finish_non_exhaustive()
    }
}
