//! A live source in a thread of its own: the newest frame wins.

pub(super) mod slot;

use std::any::Any;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::task::Waker;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use plumb_config::error_chain::ErrorChain;
use plumb_frame::clock::LiveClock;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::source::{CameraSource, SourceError};
use thiserror::Error;
use tracing::debug;

use slot::{Item, Slot};

/// Longest single wait of [`Capture::next_frame`].
const WAIT: Duration = Duration::from_millis(100);

/// Limits of the time that a [`Capture`] waits for its source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CaptureLimits {
    /// Wait for a frame or an error after which the source counts as blocked
    /// ([`CaptureError::Blocked`]).
    pub silence: Duration,
    /// Wait for the end of the thread when the capture is dropped. After that the thread is
    /// abandoned: it ends when its source returns.
    pub close: Duration,
}

impl Default for CaptureLimits {
    /// Limits above those of the OpenNI2 driver (3 s for a frame, 5 s to close after its recording
    /// has grown last), whose errors say more.
    fn default() -> Self {
        Self { silence: Duration::from_secs(4), close: Duration::from_secs(60) }
    }
}

/// Live source that is read in a thread of its own.
///
/// - The newest frame wins: a frame that was not taken when the next one comes is dropped and
///   counted ([`CameraSource::skipped`], with those that the source itself skipped). So the age of
///   a frame is bounded by the time that its reader takes for one frame, at any frame rate.
/// - Errors are never dropped, and come in order with the frames.
/// - A source that blocks, panics or ends is an error or the end of the frames within
///   [`CaptureLimits::silence`].
/// - Dropping it waits until the source is closed, for [`CaptureLimits::close`] at most.
///
/// ```
/// use plumb_cameras::capture::{Capture, CaptureLimits};
/// use plumb_frame::source::CameraSource;
/// # use std::time::Instant;
/// # use plumb_frame::clock::LiveClock;
/// # use plumb_frame::source::SourceError;
/// # use plumb_frame::frame::RgbdFrame;
/// # struct Camera(LiveClock);
/// # impl CameraSource for Camera {
/// #     fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> { Ok(None) }
/// #     fn now(&self) -> f64 { self.0.now() }
/// #     fn clock(&self) -> Option<LiveClock> { Some(self.0.clone()) }
/// # }
/// # let camera = Camera(LiveClock::since(Instant::now()));
/// let mut capture = Capture::start(camera, CaptureLimits::default())?;
/// while let Some(frame) = capture.next_frame()? {
///     println!("{:.3} s old, {} skipped", capture.now() - frame.time(), capture.skipped());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Capture {
    slot: Arc<Slot>,
    clock: LiveClock,
    limits: CaptureLimits,
    /// `None` once it is joined or abandoned.
    thread: Option<JoinHandle<()>>,
    /// Time that this capture has waited since the last item.
    waited: Duration,
    /// Whether the source is over.
    is_over: bool,
}

impl Capture {
    /// Starts to read `source`.
    ///
    /// # Errors
    /// Where the source has no clock that runs by itself, or the operating system starts no thread.
    pub fn start(
        source: impl CameraSource + Send + 'static,
        limits: CaptureLimits,
    ) -> Result<Self, StartCaptureError> {
        let clock = source.clock().ok_or(StartCaptureError::NoClock)?;
        let slot = Arc::new(Slot::<RgbdFrame>::default());
        let shared = Arc::clone(&slot);
        let thread = thread::Builder::new()
            .name("capture".to_owned())
            .spawn(move || read_all(source, &shared))
            .map_err(StartCaptureError::Thread)?;
        let (thread, waited, is_over) = (Some(thread), Duration::ZERO, false);
        Ok(Self { slot, clock, limits, thread, waited, is_over })
    }

    /// Returns whether the source has delivered nothing for too long.
    fn is_blocked(&self) -> bool {
        self.waited >= self.limits.silence
    }
}

impl CameraSource for Capture {
    /// Returns the newest frame, or the error before it. Waits for one where there is none.
    ///
    /// # Errors
    /// As the source; [`CaptureError`] where the source blocks or panics. After an error that
    /// [is over](SourceError::is_over), each call returns `None`.
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        while !self.wait(WAIT) {}
        if self.is_over {
            return Ok(None);
        }
        let item = self.slot.take();
        self.is_over = !matches!(item, Some(Item::Frame(_) | Item::Lost(_)));
        match item {
            Some(Item::Frame(frame)) => {
                self.waited = Duration::ZERO;
                Ok(Some(frame))
            }
            Some(Item::Lost(error)) => {
                self.waited = Duration::ZERO;
                Err(error)
            }
            Some(Item::End(None)) => Ok(None),
            Some(Item::End(Some(error))) => Err(error),
            None => Err(SourceError::over(CaptureError::Blocked(self.limits.silence))),
        }
    }

    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn clock(&self) -> Option<LiveClock> {
        Some(self.clock.clone())
    }

    fn wait(&mut self, limit: Duration) -> bool {
        let begin = Instant::now();
        if self.is_over || self.slot.wait(limit) {
            return true;
        }
        // A process that was suspended in between has not waited longer than the limit.
        self.waited += begin.elapsed().min(limit);
        self.is_blocked()
    }

    fn waker(&self) -> Option<Waker> {
        Some(Waker::from(Arc::clone(&self.slot)))
    }

    fn skipped(&self) -> u64 {
        self.slot.skipped()
    }
}

impl Drop for Capture {
    fn drop(&mut self) {
        self.slot.close();
        // A source that blocks does not return in time either.
        let limit = if self.is_blocked() { Duration::ZERO } else { self.limits.close };
        if self.slot.wait_for_end(limit)
            && let Some(thread) = self.thread.take()
        {
            let _panicked = thread.join();
        }
    }
}

/// Reads `source` until it is over or `slot` is closed, and closes it.
fn read_all(source: impl CameraSource, slot: &Slot) {
    let _end = slot.end_guard();
    // Dropped before the end is noted: closing a camera may take for ever.
    let mut source = source;
    let read = catch_unwind(AssertUnwindSafe(|| {
        while let Some(frame) = source.next_frame().transpose() {
            slot.set_skipped_before(source.skipped());
            let item = match frame {
                Ok(frame) => Item::Frame(frame),
                Err(error) if error.is_over() => return Some(error),
                Err(error) => Item::Lost(error),
            };
            if !slot.add(item) {
                return None;
            }
        }
        None
    }));
    let end = read.unwrap_or_else(|payload| {
        Some(SourceError::over(CaptureError::Panicked(panic_message(&*payload))))
    });
    match &end {
        Some(error) => debug!(error = %ErrorChain(error), "the camera failed"),
        None => debug!("the camera was closed, or has no more frames"),
    }
    slot.add(Item::End(end));
    // Before the end of the thread is marked.
    drop(source);
}

/// Returns the message of a panic.
pub fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}

/// Failure of the thread that reads a source.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// The source has delivered neither a frame nor an error for this long.
    #[error(
        "the camera has delivered nothing for {:.1} s and does not answer; unplug it and plug it \
         in again",
        .0.as_secs_f64()
    )]
    Blocked(Duration),
    /// The source has panicked, with this message.
    #[error("the camera's driver has panicked: {0}; please report this as a defect of Plumb")]
    Panicked(String),
}

/// Failure to start a capture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StartCaptureError {
    /// The source does not run in real time.
    #[error("this source has no clock of its own: only a camera can be read in a thread")]
    NoClock,
    /// The operating system starts no thread.
    #[error("cannot start the thread that reads the camera")]
    Thread(#[source] io::Error),
}

#[cfg(test)]
mod tests;
