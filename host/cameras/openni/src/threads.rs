//! Threads that call the library, and values that live on one.
//!
//! The threads never end. The library keeps the number of each thread that called it, and asks the
//! system about them later (`pthread_kill` with signal 0, in `xnOSDoesThreadExistByID`). A number
//! whose thread has ended, and whose memory was returned, is a crash.

use std::fmt;
use std::io;
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use crate::error::OpenniError;

/// Work for a thread.
type Job = Box<dyn FnOnce() + Send>;

/// Threads that are used again and again, by the senders of the jobs of those without one.
struct Threads(Mutex<Vec<Sender<Job>>>);

/// The threads that call the library.
static THREADS: Threads = Threads::new();

/// Runs `job` on a thread of its own, an idle one where there is one. Returns the receiver of its
/// result; without a sender the job has panicked.
///
/// # Errors
/// Where the system has no thread left.
pub(crate) fn run<T: Send + 'static>(
    job: impl FnOnce() -> T + Send + 'static,
) -> io::Result<Receiver<T>> {
    THREADS.run(job)
}

impl Threads {
    const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    fn idle(&self) -> MutexGuard<'_, Vec<Sender<Job>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// See [`run`].
    fn run<T: Send + 'static>(
        &'static self,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> io::Result<Receiver<T>> {
        let (done, result) = mpsc::channel();
        let waiting = self.idle().pop();
        let thread = waiting.map_or_else(start, Ok)?;
        let own = thread.clone();
        let job = move || {
            let value = job();
            self.idle().push(own);
            // The caller may have given up.
            let _ = done.send(value);
        };
        // An idle thread and a new one wait for their job.
        let _ = thread.send(Box::new(job));
        Ok(result)
    }
}

/// Starts a thread, and returns the sender of its jobs.
fn start() -> io::Result<Sender<Job>> {
    let (sender, jobs) = mpsc::channel::<Job>();
    let thread = thread::Builder::new().name("openni".to_owned());
    thread.spawn(move || jobs.into_iter().for_each(|job| job()))?;
    Ok(sender)
}

/// Function of a value, which its thread calls.
type Call<T> = Box<dyn FnOnce(&mut T) + Send>;

/// Camera or recording that lives on a thread of the library, which makes all its calls. A thread
/// whose call does not return is abandoned, and the function that waits for it fails.
pub(crate) struct OnThread<T> {
    /// URI of the camera, or path of the recording.
    uri: String,
    calls: Sender<Call<T>>,
    /// Receives the end of the value.
    ended: Receiver<()>,
}

impl<T: 'static> OnThread<T> {
    /// Opens the camera or recording `uri` on a thread, with `open`. Returns its second result too.
    ///
    /// # Errors
    /// As `open`; where it takes longer than `limit`, or the system has no thread left.
    pub(crate) fn open<R: Send + 'static>(
        uri: String,
        limit: Duration,
        open: impl FnOnce() -> Result<(T, R), OpenniError> + Send + 'static,
    ) -> Result<(Self, R), OpenniError> {
        let (calls, received) = mpsc::channel::<Call<T>>();
        let (done, opened) = mpsc::channel();
        // The caller may have given up, and then there are no calls.
        let work = move || match open() {
            Ok((mut value, result)) => {
                let _ = done.send(Ok(result));
                received.into_iter().for_each(|call| call(&mut value));
            }
            Err(error) => {
                let _ = done.send(Err(error));
            }
        };
        let ended = match run(work) {
            Ok(ended) => ended,
            Err(error) => return Err(OpenniError::Open { uri, error: error.to_string() }),
        };
        let result = answer(&uri, &opened, "opening it", limit)??;
        Ok((Self { uri, calls, ended }, result))
    }

    /// Returns the result of `function`, which is called on the thread.
    ///
    /// # Errors
    /// Where it does not return within `limit`. `what` says what it does, for a person.
    pub(crate) fn call<R: Send + 'static>(
        &self,
        what: &'static str,
        limit: Duration,
        function: impl FnOnce(&mut T) -> R + Send + 'static,
    ) -> Result<R, OpenniError> {
        let (done, result) = mpsc::channel();
        let call = move |value: &mut T| {
            // The caller may have given up.
            let _ = done.send(function(value));
        };
        // A thread that has panicked receives no calls, and gives no answer.
        let _ = self.calls.send(Box::new(call));
        answer(&self.uri, &result, what, limit)
    }

    /// Closes the camera or recording.
    ///
    /// # Errors
    /// Where that takes longer than `limit`, and `goes_on` says at the end of one that no work is
    /// done. It then stays open.
    pub(crate) fn close(
        self,
        limit: Duration,
        mut goes_on: impl FnMut() -> bool,
    ) -> Result<(), OpenniError> {
        drop(self.calls);
        loop {
            let closed = answer(&self.uri, &self.ended, "closing it", limit);
            if closed.is_ok() || !goes_on() {
                return closed;
            }
        }
    }
}

/// Returns what a thread of `uri` sends as `result` within `limit`.
fn answer<R>(
    uri: &str,
    result: &Receiver<R>,
    what: &'static str,
    limit: Duration,
) -> Result<R, OpenniError> {
    let seconds = limit.as_secs_f64();
    let failed = |_| OpenniError::Unresponsive { uri: uri.to_owned(), what, seconds };
    result.recv_timeout(limit).map_err(failed)
}

impl<T> fmt::Debug for OnThread<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OnThread").field("uri", &self.uri).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_is_used_again_after_its_job_and_never_after_a_panic() {
        // Other tests use the threads of the library meanwhile.
        static OWN: Threads = Threads::new();
        let number = || thread::current().id();
        let first = OWN.run(number).unwrap().recv().unwrap();
        assert_eq!(OWN.run(number).unwrap().recv().unwrap(), first);
        let (free, blocked) = mpsc::channel::<()>();
        let busy = OWN.run(move || blocked.recv()).unwrap();
        assert_ne!(OWN.run(number).unwrap().recv().unwrap(), first);
        free.send(()).unwrap();
        busy.recv().unwrap().unwrap();
        let panics = || assert!(OWN.idle().is_empty(), "a panic on purpose");
        assert!(OWN.run(panics).unwrap().recv().is_err());
        assert_eq!(OWN.idle().len(), 1);
    }

    const LONG: Duration = Duration::from_secs(60);
    const SHORT: Duration = Duration::from_millis(20);

    /// Value that reports the thread of its end.
    struct Value(Sender<thread::ThreadId>);

    impl Drop for Value {
        fn drop(&mut self) {
            let _ = self.0.send(thread::current().id());
        }
    }

    #[test]
    fn a_value_is_made_called_and_dropped_on_one_thread() {
        let (dropped, end) = mpsc::channel();
        let open = || Ok((Value(dropped), ()));
        let (value, ()) = OnThread::open("a".to_owned(), LONG, open).unwrap();
        let thread = value.call("a call", LONG, |_| thread::current().id()).unwrap();
        assert_ne!(thread, thread::current().id());
        assert_eq!(value.close(LONG, || false), Ok(()));
        assert_eq!(end.recv(), Ok(thread));
    }

    #[test]
    fn a_call_that_does_not_return_is_an_error_and_the_value_is_dropped_when_it_does() {
        let (dropped, end) = mpsc::channel();
        let open = || Ok((Value(dropped), ()));
        let (value, ()) = OnThread::open("a".to_owned(), LONG, open).unwrap();
        let (free, blocked) = mpsc::channel::<()>();
        let error = value.call("a call", SHORT, move |_| blocked.recv()).unwrap_err();
        assert!(error.to_string().contains("does not return from a call"), "{error}");
        let error = value.close(SHORT, || false).unwrap_err();
        assert!(error.to_string().contains("closing it"), "{error}");
        assert!(end.try_recv().is_err());
        free.send(()).unwrap();
        end.recv().unwrap();
    }

    #[test]
    fn a_value_that_still_works_is_waited_for_at_its_end() {
        let (dropped, end) = mpsc::channel();
        let open = || Ok((Value(dropped), ()));
        let (value, ()) = OnThread::open("a".to_owned(), LONG, open).unwrap();
        let (free, blocked) = mpsc::channel::<()>();
        assert!(value.call("a call", SHORT, move |_| blocked.recv()).is_err());
        let mut waits = 0;
        let goes_on = || {
            waits += 1;
            if waits == 3 {
                free.send(()).unwrap();
            }
            true
        };
        assert_eq!(value.close(SHORT, goes_on), Ok(()));
        assert!(waits >= 3, "{waits}");
        end.recv().unwrap();
    }

    #[test]
    fn an_opening_that_takes_too_long_is_an_error_and_its_value_is_dropped() {
        let (dropped, end) = mpsc::channel();
        let (free, blocked) = mpsc::channel::<()>();
        let slow = move || {
            let _ = blocked.recv();
            Ok((Value(dropped), ()))
        };
        let error = OnThread::open("a".to_owned(), SHORT, slow).unwrap_err();
        assert!(error.to_string().contains("opening it"), "{error}");
        free.send(()).unwrap();
        end.recv().unwrap();
    }
}
