//! Handles that are deleted when they are dropped, and calls of the library that may not return.

use core::ffi::c_void;
use std::panic::resume_unwind;
use std::ptr::NonNull;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;
use std::{io, thread};

use crate::sys::Handle;

/// Function that deletes a handle.
pub(crate) type Delete = unsafe extern "C" fn(Handle);

/// Handle of the library, deleted when it is dropped. A recording is complete only after all
/// handles of its device are deleted.
#[derive(Debug)]
pub(crate) struct Owned {
    raw: NonNull<c_void>,
    delete: Delete,
}

impl Owned {
    /// Takes over `raw`, a new handle that `delete` deletes.
    ///
    /// # Errors
    /// Where the handle is null.
    pub(crate) fn new(raw: Handle, delete: Delete) -> Result<Self, String> {
        let raw = NonNull::new(raw).ok_or("it returned nothing")?;
        Ok(Self { raw, delete })
    }

    /// Returns the handle for a call. It stays owned.
    pub(crate) fn raw(&self) -> Handle {
        self.raw.as_ptr()
    }

    /// Returns the handle and gives up its ownership.
    pub(crate) fn into_raw(self) -> Handle {
        let raw = self.raw();
        std::mem::forget(self);
        raw
    }
}

impl Drop for Owned {
    fn drop(&mut self) {
        // SAFETY: the handle is of the kind that the function deletes, and is not used after this.
        unsafe { (self.delete)(self.raw()) };
    }
}

// SAFETY: librealsense2 locks its objects itself; a handle may be used and deleted in any thread.
// This crate uses a handle from one thread at a time.
unsafe impl Send for Owned {}

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
