//! Handles that are deleted when they are dropped.

use std::ptr::NonNull;

use core::ffi::c_void;

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
