//! Functions of a driver that OpenNI2 calls (`OniDriverAPI.h`, 2.2).

use core::ffi::{c_int, c_void};

use plumb_openni::sys::*;

/// Declares functions of a driver. Only the library calls them, with pointers that are valid by the
/// rules of the interface: handles are from this driver and not closed, and a property's buffer has
/// the given size.
macro_rules! driver {
    ($(
        $(#[$doc:meta])*
        fn $name:ident($($argument:ident: $type:ty),*) $(-> $answer:ty)? $body:block
    )*) => {$(
        $(#[$doc])*
        ///
        /// # Safety
        /// Called by OpenNI2 with valid pointers.
        #[unsafe(no_mangle)]
        #[allow(non_snake_case, reason = "the names are OpenNI2's")]
        pub(crate) unsafe extern "C" fn $name($($argument: $type),*) $(-> $answer)? $body
    )*};
}

mod device;
mod stream;

/// Returns the value of a property to set; `None` if it has another size.
///
/// # Safety
/// `data` has `size` bytes, and any bytes are a valid `T`.
unsafe fn value<T: Copy>(data: *const c_void, size: c_int) -> Option<T> {
    // SAFETY: guaranteed by the caller; the library's buffers may be unaligned.
    (size as usize == size_of::<T>()).then(|| unsafe { data.cast::<T>().read_unaligned() })
}

/// Writes the value of a property.
///
/// # Safety
/// `*size` bytes at `data` are writable.
unsafe fn write<T: Copy>(data: *mut c_void, size: *mut c_int, value: T) -> OniStatus {
    // SAFETY: guaranteed by the caller.
    if unsafe { *size } as usize != size_of::<T>() {
        return STATUS_BAD_PARAMETER;
    }
    // SAFETY: guaranteed by the caller; the library's buffers may be unaligned.
    unsafe { data.cast::<T>().write_unaligned(value) };
    STATUS_OK
}
