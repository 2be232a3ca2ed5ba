//! Open camera or recording.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use crate::error::OpenniError;
use crate::library::OpenNi;
use crate::mailbox::{Event, Mailbox, Overflow};
use crate::picture::Pair;
use crate::settings::{Opened, Settings, Target, Timeouts};
use crate::threads;
use crate::worker::Worker;

/// Pairs that may wait to be taken: of a camera the newest only.
const LIVE_ROOM: usize = 1;
/// Pairs of a recording that are read ahead.
const RECORDING_ROOM: usize = 4;
/// Time that the worker may exceed its own timeout before it counts as blocked.
const WORKER_GRACE: Duration = Duration::from_secs(1);

/// Camera or recording that delivers colour and depth in pairs.
///
/// A thread of its own makes all calls into the library. A thread whose call does not return is
/// abandoned, and the operation that waits for it fails.
#[derive(Debug)]
pub struct Camera {
    opened: Opened,
    timeouts: Timeouts,
    mailbox: Arc<Mailbox<Event>>,
    /// Receives the end of the worker; `None` once that was waited for.
    worker: Option<Receiver<()>>,
    /// Start of the clock that stamps live pictures.
    start: Instant,
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
        let mailbox = Arc::new(if target.is_recording() {
            Mailbox::new(RECORDING_ROOM, Overflow::Block)
        } else {
            Mailbox::new(LIVE_ROOM, Overflow::Drop)
        });
        let first = Arc::new(Mailbox::new(1, Overflow::Block));
        let (start, timeouts) = (Instant::now(), settings.timeouts);
        let worker = Worker {
            openni: openni.clone(),
            target: target.clone(),
            settings,
            start,
            opened: Arc::clone(&first),
            mailbox: Arc::clone(&mailbox),
        };
        let worker = threads::run(move || worker.run())
            .map_err(|error| OpenniError::Open { uri: target.name(), error: error.to_string() })?;
        let Some(opened) = first.receive(timeouts.open) else {
            mailbox.close();
            let seconds = timeouts.open.as_secs_f64();
            let (uri, what) = (target.name(), "opening it");
            return Err(OpenniError::Unresponsive { uri, what, seconds });
        };
        Ok(Self { opened: opened?, timeouts, mailbox, worker: Some(worker), start, ended: None })
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

    /// Returns the next pair: the newest of a camera, each one of a recording, `None` at the end of
    /// a recording. Returns or fails within [`Timeouts::picture`] and one second.
    ///
    /// # Errors
    /// Where a picture is lost ([`OpenniError::is_transient`]); the next one may come. Any other
    /// error is final, and every further call returns it again.
    pub fn next_pair(&mut self) -> Result<Option<Pair>, OpenniError> {
        if let Some(ended) = &self.ended {
            return ended.clone().map(|()| None);
        }
        // The worker reports a silent camera by itself; this timeout is for a blocked worker.
        let timeout = self.timeouts.picture + WORKER_GRACE;
        let event = self.mailbox.receive(timeout).unwrap_or_else(|| {
            let (uri, what) = (self.opened.uri.clone(), "waiting for a picture");
            let seconds = timeout.as_secs_f64();
            Event::Over(Err(OpenniError::Unresponsive { uri, what, seconds }))
        });
        match event {
            Event::Pair(pair) => Ok(Some(pair)),
            Event::Problem(error) => Err(error),
            Event::Over(result) => {
                self.ended = Some(result.clone());
                result.map(|()| None)
            }
        }
    }

    /// Stops and closes the camera, and completes its recording.
    ///
    /// # Errors
    /// Where that takes longer than [`Timeouts::close`]. The camera then stays open.
    pub fn close(mut self) -> Result<(), OpenniError> {
        self.end()
    }

    fn end(&mut self) -> Result<(), OpenniError> {
        self.mailbox.close();
        let Some(worker) = self.worker.take() else { return Ok(()) };
        if worker.recv_timeout(self.timeouts.close) == Err(RecvTimeoutError::Timeout) {
            let (uri, what) = (self.opened.uri.clone(), "closing it");
            let seconds = self.timeouts.close.as_secs_f64();
            return Err(OpenniError::Unresponsive { uri, what, seconds });
        }
        Ok(())
    }
}

impl Drop for Camera {
    fn drop(&mut self) {
        // close() returns this error.
        let _ = self.end();
    }
}
