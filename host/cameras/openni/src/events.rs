//! What the library tells unasked: cameras that come and go, recordings that end.

use core::ffi::{c_char, c_int, c_void};
use std::collections::HashSet;
use std::ffi::CStr;
use std::sync::{Mutex, PoisonError};

use crate::sys::{DEVICE_STATE_EOF, OniDeviceCallbacks, OniDeviceInfo};

/// The URIs that something was told of.
#[derive(Debug, Default)]
pub(crate) struct Events {
    gone: Mutex<HashSet<String>>,
    ended: Mutex<HashSet<String>>,
}

impl Events {
    /// Whether this camera was unplugged.
    pub(crate) fn is_gone(&self, uri: &str) -> bool {
        lock(&self.gone).contains(uri)
    }

    /// Whether this recording was played to its end.
    pub(crate) fn has_ended(&self, uri: &str) -> bool {
        lock(&self.ended).contains(uri)
    }

    /// Forgets the recording's end: it is opened anew.
    pub(crate) fn begin(&self, uri: &str) {
        lock(&self.ended).remove(uri);
    }

    /// What to register, with this as its cookie.
    pub(crate) fn callbacks() -> OniDeviceCallbacks {
        OniDeviceCallbacks { connected, disconnected, state_changed }
    }
}

fn lock(set: &Mutex<HashSet<String>>) -> std::sync::MutexGuard<'_, HashSet<String>> {
    set.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A string of the library's in a field of fixed length, which may lack its closing zero.
pub(crate) fn text(field: &[c_char]) -> String {
    let bytes: Vec<u8> =
        field.iter().take_while(|&&c| c != 0).map(|&c| c.to_ne_bytes()[0]).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A string of the library's; empty for a null pointer.
///
/// # Safety
/// `pointer` is null or points to a string with a closing zero that stays as it is during this
/// call.
pub(crate) unsafe fn owned(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: as this function's caller promises.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().trim().to_owned()
}

/// The events and the URI that a callback is about.
///
/// # Safety
/// `cookie` is what was registered, a leaked [`Events`]; `info` is null or points to a device's
/// description.
unsafe fn about<'a>(
    info: *const OniDeviceInfo,
    cookie: *mut c_void,
) -> Option<(&'a Events, String)> {
    // SAFETY: it is never freed, and only shared.
    let events = unsafe { cookie.cast::<Events>().as_ref() }?;
    // SAFETY: as this function's caller promises; it is read before the callback returns.
    let info = unsafe { info.as_ref() }?;
    Some((events, text(&info.uri)))
}

unsafe extern "C" fn connected(info: *const OniDeviceInfo, cookie: *mut c_void) {
    // SAFETY: called by the library with the cookie that it was given, and a device's description.
    if let Some((events, uri)) = unsafe { about(info, cookie) } {
        lock(&events.gone).remove(&uri);
    }
}

unsafe extern "C" fn disconnected(info: *const OniDeviceInfo, cookie: *mut c_void) {
    // SAFETY: called by the library with the cookie that it was given, and a device's description.
    if let Some((events, uri)) = unsafe { about(info, cookie) } {
        lock(&events.gone).insert(uri);
    }
}

unsafe extern "C" fn state_changed(info: *const OniDeviceInfo, state: c_int, cookie: *mut c_void) {
    // SAFETY: called by the library with the cookie that it was given, and a device's description.
    if let Some((events, uri)) = unsafe { about(info, cookie) }
        && state == DEVICE_STATE_EOF
    {
        lock(&events.ended).insert(uri);
    }
}
