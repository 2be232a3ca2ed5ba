//! Reading of a started camera or recording.

use std::time::{Duration, Instant};

use plumb_frame::clock::SensorClocks;
use plumb_frame::pairing::{Paired, Pairing, Sensor, Taken, Timed};

use crate::device::Device;
use crate::error::OpenniError;
use crate::mailbox::{Event, Mailbox};
use crate::picture::{Pair, Picture};
use crate::recorder::Recorder;

/// Longest wait inside the library: the reaction time to a stop or an unplugging.
const WAIT: Duration = Duration::from_millis(100);

/// Largest difference between the time stamps of a pair, in periods of the camera. From half a
/// period on each picture would have a counterpart, however far the streams are out of step.
const PAIR_PERIODS: f64 = 0.4;

/// Options of a [`Reader`].
pub(crate) struct ReaderOptions {
    /// Whether the device is a recording.
    pub(crate) is_recording: bool,
    /// Start of the clock that stamps live pictures.
    pub(crate) start: Instant,
    /// Time from exposure to the earliest arrival of a picture, seconds.
    pub(crate) latency: f64,
    /// Time without a picture after which the camera is silent.
    pub(crate) timeout: Duration,
}

/// Reader of a started camera or recording.
pub(crate) struct Reader {
    options: ReaderOptions,
    /// Is dropped before the device, from whose streams it completes its file.
    recorder: Option<Recorder>,
    device: Device,
    pairing: Pairing<Taken<Picture>>,
    clocks: SensorClocks,
    /// Number of the last picture, of colour and of depth; -1 before the first one.
    last: [i32; 2],
    last_arrival: Instant,
}

impl Reader {
    pub(crate) fn new(options: ReaderOptions, recorder: Option<Recorder>, device: Device) -> Self {
        let rate = f64::from(device.colour.mode.rate.max(1));
        Self {
            clocks: SensorClocks::new(options.latency),
            options,
            recorder,
            device,
            pairing: Pairing::new(PAIR_PERIODS / rate),
            last: [-1; 2],
            last_arrival: Instant::now(),
        }
    }

    /// Sends pairs to `mailbox` until the camera is over or the mailbox is closed.
    ///
    /// # Errors
    /// Where the camera is unplugged or silent, a call fails, or a recording is truncated.
    pub(crate) fn run(&mut self, mailbox: &Mailbox<Event>) -> Result<(), OpenniError> {
        while !mailbox.is_closed() {
            if self.device.is_unplugged() {
                self.recorder = None;
                self.device.abandon();
                return Err(OpenniError::Unplugged { uri: self.device.uri.clone() });
            }
            match self.device.next(WAIT) {
                Ok(Some(picture)) => {
                    self.last_arrival = Instant::now();
                    self.on_picture(picture, mailbox);
                }
                Ok(None) => {
                    if let Some(over) = self.on_silence() {
                        return over;
                    }
                }
                Err(error) if error.is_transient() => {
                    self.last_arrival = Instant::now();
                    mailbox.send(Event::Problem(error));
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Pairs the picture with its counterpart, and sends pairs and losses.
    fn on_picture(&mut self, picture: Picture, mailbox: &Mailbox<Event>) {
        let sensor = picture.sensor;
        if let Some(error) = self.skipped(&picture) {
            mailbox.send(Event::Problem(error));
        }
        self.last[sensor.index()] = picture.index;
        let time = self.time(&picture);
        self.pairing.add(sensor, Taken { picture, time });
        while let Some(result) = self.pairing.take() {
            mailbox.send(self.event(result));
        }
    }

    /// Returns the event of a pair or of a loss.
    fn event(&self, result: Paired<Taken<Picture>>) -> Event {
        match result {
            Paired::Pair(Taken { picture: colour, time }, Taken { picture: depth, .. }) => {
                // A synchronised camera gives both pictures of a moment the same number.
                if self.device.is_synchronised() && colour.index != depth.index {
                    let (colour, depth) = (colour.index, depth.index);
                    return Event::Problem(OpenniError::OutOfStep { colour, depth, time });
                }
                Event::Pair(Pair::new(time, colour, &depth))
            }
            Paired::Unpaired(sensor, Taken { time, .. }) => {
                let within = self.pairing.within();
                Event::Problem(OpenniError::Unpaired { sensor, time, within })
            }
        }
    }

    /// Returns the time of a picture that has just arrived: of a recording on its own clock, of a
    /// camera on the host's.
    fn time(&mut self, picture: &Picture) -> f64 {
        if self.options.is_recording {
            return picture.time();
        }
        let arrival = self.options.start.elapsed().as_secs_f64();
        self.clocks.taken(picture.sensor, picture.time(), arrival)
    }

    /// Returns an error where pictures of a recording are missing before this one. A camera may
    /// skip pictures.
    fn skipped(&self, picture: &Picture) -> Option<OpenniError> {
        let last = self.last[picture.sensor.index()];
        let count = picture.index.saturating_sub(last).saturating_sub(1);
        let lost = self.options.is_recording && last >= 0 && count > 0;
        lost.then(|| OpenniError::Skipped { sensor: picture.sensor, count, time: picture.time() })
    }

    /// Returns how the camera ended where no picture came within [`WAIT`]; `None` where it goes on.
    fn on_silence(&self) -> Option<Result<(), OpenniError>> {
        let silence = self.last_arrival.elapsed();
        let is_silent = silence >= self.options.timeout;
        if self.options.is_recording {
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
