//! Strings of the library.

use core::ffi::c_char;
use std::ffi::CStr;

/// Returns the string in a field of fixed length, which may lack its final zero.
pub(crate) fn text(field: &[c_char]) -> String {
    let bytes: Vec<u8> =
        field.iter().take_while(|&&c| c != 0).map(|&c| c.to_ne_bytes()[0]).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Returns the string at `pointer`; empty for a null pointer.
///
/// # Safety
/// `pointer` is null or points to a string with a final zero that does not change during this call.
pub(crate) unsafe fn owned(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: the caller guarantees it.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().trim().to_owned()
}
