//! Calls of the library that may not return.

use std::io;
use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

/// Failure of a call in a thread of its own.
#[derive(Debug)]
pub(crate) enum Unfinished {
    /// The operating system starts no thread.
    Thread(io::Error),
    /// The call did not return in time.
    Late,
}

/// Makes a call in a thread of its own, and returns its result. A call that takes longer than
/// `limit` is abandoned: its thread ends when the call returns, and drops the result.
pub(crate) fn within<T: Send + 'static>(
    limit: Duration,
    call: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Unfinished> {
    let (sender, receiver) = sync_channel(1);
    let run = move || {
        // Fails where the caller has given up.
        let _ = sender.send(call());
    };
    let thread = thread::Builder::new().name("realsense".to_owned()).spawn(run);
    let thread = thread.map_err(Unfinished::Thread)?;
    match receiver.recv_timeout(limit) {
        Ok(result) => Ok(result),
        Err(RecvTimeoutError::Timeout) => Err(Unfinished::Late),
        // The call panicked, and this thread panics as it did.
        Err(RecvTimeoutError::Disconnected) => {
            thread.join().map_or_else(|payload| resume_unwind(payload), |()| Err(Unfinished::Late))
        }
    }
}
