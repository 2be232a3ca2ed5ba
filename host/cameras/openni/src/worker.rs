//! Thread that makes all calls into the library for one camera.

use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use std::{io, thread};

use crate::device::Device;
use crate::error::OpenniError;
use crate::library::OpenNi;
use crate::mailbox::Event;
use crate::mailbox::Mailbox;
use crate::reader::{Reader, ReaderOptions};
use crate::recorder::Recorder;
use crate::settings::DepthUnit;
use crate::settings::{Opened, Settings, Target};
use crate::sys;

/// Inputs and outputs of the thread.
pub(crate) struct Worker {
    pub(crate) openni: OpenNi,
    pub(crate) target: Target,
    pub(crate) settings: Settings,
    /// Start of the clock that stamps live pictures.
    pub(crate) start: Instant,
    /// Receives the description of the open camera, or why it cannot be opened.
    pub(crate) opened: Arc<Mailbox<Result<Opened, OpenniError>>>,
    /// Receives the pictures.
    pub(crate) mailbox: Arc<Mailbox<Event>>,
}

impl Worker {
    /// Opens the camera, sends its description, and sends its pictures until it is over or the
    /// mailbox is closed.
    pub(crate) fn run(self) {
        match self.open() {
            Ok((device, recorder, opened)) => {
                self.opened.send(Ok(opened));
                let options = ReaderOptions {
                    is_recording: self.target.is_recording(),
                    start: self.start,
                    latency: self.settings.latency,
                    timeout: self.settings.timeouts.picture,
                };
                let mut reader = Reader::new(options, recorder, device);
                let over = reader.run(&self.mailbox);
                self.mailbox.send(Event::Over(over));
            }
            Err(error) => {
                self.opened.send(Err(error));
            }
        }
    }

    /// Opens the camera and starts it, with its own recording where that is asked for.
    fn open(&self) -> Result<(Device, Option<Recorder>, Opened), OpenniError> {
        let mut device = Device::open(&self.openni, &self.target, &self.settings)?;
        let recorder = match &self.settings.record {
            Some(path) => Some(Recorder::start(&device, path)?),
            None => None,
        };
        device.start()?;
        let mut notes = Vec::new();
        if !self.target.is_recording()
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
}

/// Work for a thread.
type Job = Box<dyn FnOnce() + Send>;

/// Threads without a job, by the sender of their jobs.
static IDLE: Mutex<Vec<Sender<Job>>> = Mutex::new(Vec::new());

fn idle() -> MutexGuard<'static, Vec<Sender<Job>>> {
    IDLE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs `job` on a thread of its own, an idle one where there is one. Returns the receiver of its
/// result; without a sender the job has panicked.
///
/// # Errors
/// Where the system has no thread left.
pub(crate) fn run<T: Send + 'static>(
    job: impl FnOnce() -> T + Send + 'static,
) -> io::Result<Receiver<T>> {
    let (done, result) = mpsc::channel();
    let waiting = idle().pop();
    let thread = waiting.map_or_else(start, Ok)?;
    let own = thread.clone();
    let job = move || {
        let value = job();
        idle().push(own);
        // The caller may have given up.
        let _ = done.send(value);
    };
    // An idle thread and a new one wait for their job.
    let _ = thread.send(Box::new(job));
    Ok(result)
}

/// Starts a thread, and returns the sender of its jobs.
fn start() -> io::Result<Sender<Job>> {
    let (sender, jobs) = mpsc::channel::<Job>();
    let thread = thread::Builder::new().name("openni".to_owned());
    thread.spawn(move || jobs.into_iter().for_each(|job| job()))?;
    Ok(sender)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_is_used_again_after_its_job_and_never_after_a_panic() {
        let number = || thread::current().id();
        let first = run(number).unwrap().recv().unwrap();
        assert_eq!(run(number).unwrap().recv().unwrap(), first);
        let (free, blocked) = mpsc::channel::<()>();
        let busy = run(move || blocked.recv()).unwrap();
        assert_ne!(run(number).unwrap().recv().unwrap(), first);
        free.send(()).unwrap();
        busy.recv().unwrap().unwrap();
        assert!(run(|| assert!(idle().is_empty(), "a panic on purpose")).unwrap().recv().is_err());
    }
}
