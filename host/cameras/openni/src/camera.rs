//! Open camera or recording.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use plumb_pictures::pair::Pair;

use crate::error::OpenniError;
use crate::library::OpenNi;
use crate::reader::Reader;
use crate::settings::{Opened, Settings, Target, Timeouts};
use crate::threads::OnThread;

/// Time that the reader may exceed its own timeout before its thread counts as blocked.
const GRACE: Duration = Duration::from_secs(1);

/// Camera or recording that delivers colour and depth in pairs.
///
/// A thread of its own makes all calls into the library. A thread whose call does not return is
/// abandoned, and the operation that waits for it fails.
#[derive(Debug)]
pub struct Camera {
    opened: Opened,
    timeouts: Timeouts,
    /// The device's own recording.
    recording: Option<PathBuf>,
    /// `None` once it is closed.
    reader: Option<OnThread<Reader>>,
    /// Start of the clock that stamps live pictures.
    start: Instant,
    /// How the camera or recording ended.
    ended: Option<Result<(), OpenniError>>,
}

impl Camera {
    /// Opens `target` with `settings`, and starts it. Depth is registered to colour, mirroring is
    /// off, size and rate are those of the settings.
    ///
    /// # Errors
    /// Where there is no such camera, it does not accept a setting, or opening takes longer than
    /// [`Timeouts::open`].
    pub fn open(openni: &OpenNi, target: &Target, settings: Settings) -> Result<Self, OpenniError> {
        let (start, timeouts) = (Instant::now(), settings.timeouts);
        let recording = settings.record.clone();
        let (openni, of_target) = (openni.clone(), target.clone());
        let open = move || Reader::open(&openni, &of_target, &settings, start);
        let (reader, opened) = OnThread::open(target.name(), timeouts.open, open)?;
        Ok(Self { opened, timeouts, recording, reader: Some(reader), start, ended: None })
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

    /// Returns the next pair: of a camera the next one that comes, of a recording each one, `None`
    /// at its end. Returns or fails within [`Timeouts::picture`] and one second.
    ///
    /// # Errors
    /// Where a picture is lost ([`OpenniError::is_transient`]); the next one may come. Any other
    /// error is final, and every further call returns it again.
    pub fn next_pair(&mut self) -> Result<Option<Pair>, OpenniError> {
        if let Some(ended) = &self.ended {
            return ended.clone().map(|()| None);
        }
        let Some(reader) = &self.reader else { return Ok(None) };
        // The reader reports a silent camera by itself; this limit is for a blocked call.
        let limit = self.timeouts.picture + GRACE;
        let next = reader.call("waiting for a picture", limit, Reader::next);
        let next = next.and_then(|next| next);
        match &next {
            Ok(Some(_)) => {}
            Ok(None) => self.ended = Some(Ok(())),
            Err(error) if error.is_transient() => {}
            Err(error) => self.ended = Some(Err(error.clone())),
        }
        next
    }

    /// Stops and closes the camera, and completes its recording.
    ///
    /// # Errors
    /// Where that takes longer than [`Timeouts::close`]. The camera then stays open, and its
    /// recording is incomplete.
    pub fn close(mut self) -> Result<(), OpenniError> {
        self.end()
    }

    fn end(&mut self) -> Result<(), OpenniError> {
        let Some(reader) = self.reader.take() else { return Ok(()) };
        // The recorder still writes the pictures of its queue.
        let length = || Some(std::fs::metadata(self.recording.as_ref()?).ok()?.len());
        let mut before = length();
        reader.close(self.timeouts.close, || {
            let now = length();
            std::mem::replace(&mut before, now) != now
        })
    }
}

impl Drop for Camera {
    fn drop(&mut self) {
        // close() returns this error.
        let _ = self.end();
    }
}
