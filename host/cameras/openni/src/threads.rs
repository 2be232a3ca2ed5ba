//! Threads that call the library.
//!
//! They never end. The library keeps the number of each thread that called it, and asks the system
//! about them later (`pthread_kill` with signal 0, in `xnOSDoesThreadExistByID`). A number whose
//! thread has ended, and whose memory was returned, is a crash.

use std::io;
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

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
