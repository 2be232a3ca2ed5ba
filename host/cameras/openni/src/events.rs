//! Events of the library: cameras that are plugged in or unplugged, recordings that end.

use core::ffi::{c_int, c_void};
use std::collections::HashSet;
use std::sync::{Mutex, PoisonError};

use crate::sys::{DEVICE_STATE_EOF, OniDeviceCallbacks, OniDeviceInfo, text};

/// URIs of unplugged cameras and of recordings at their end.
#[derive(Debug, Default)]
pub(crate) struct Events {
    unplugged: Mutex<HashSet<String>>,
    ended: Mutex<HashSet<String>>,
}

impl Events {
    /// Returns whether this camera was unplugged.
    pub(crate) fn is_unplugged(&self, uri: &str) -> bool {
        lock(&self.unplugged).contains(uri)
    }

    /// Returns whether this recording was played to its end.
    pub(crate) fn has_ended(&self, uri: &str) -> bool {
        lock(&self.ended).contains(uri)
    }

    /// Removes the recording from those at their end, before it is opened again.
    pub(crate) fn reset(&self, uri: &str) {
        lock(&self.ended).remove(uri);
    }

    /// Returns the callbacks to register, with an [`Events`] as their cookie.
    pub(crate) fn callbacks() -> OniDeviceCallbacks {
        OniDeviceCallbacks { connected, disconnected, state_changed }
    }
}

fn lock(set: &Mutex<HashSet<String>>) -> std::sync::MutexGuard<'_, HashSet<String>> {
    set.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the events of a callback's cookie, and the URI of its device.
///
/// # Safety
/// `cookie` points to the leaked [`Events`] that was registered; `info` is null or points to a
/// device's description.
unsafe fn about<'a>(
    info: *const OniDeviceInfo,
    cookie: *mut c_void,
) -> Option<(&'a Events, String)> {
    // SAFETY: the events are never freed, and only shared.
    let events = unsafe { cookie.cast::<Events>().as_ref() }?;
    // SAFETY: the caller guarantees it; the description is read before the callback returns.
    let info = unsafe { info.as_ref() }?;
    Some((events, text(&info.uri)))
}

unsafe extern "C" fn connected(info: *const OniDeviceInfo, cookie: *mut c_void) {
    // SAFETY: the library passes the registered cookie and a device's description.
    if let Some((events, uri)) = unsafe { about(info, cookie) } {
        lock(&events.unplugged).remove(&uri);
    }
}

unsafe extern "C" fn disconnected(info: *const OniDeviceInfo, cookie: *mut c_void) {
    // SAFETY: the library passes the registered cookie and a device's description.
    if let Some((events, uri)) = unsafe { about(info, cookie) } {
        lock(&events.unplugged).insert(uri);
    }
}

unsafe extern "C" fn state_changed(info: *const OniDeviceInfo, state: c_int, cookie: *mut c_void) {
    // SAFETY: the library passes the registered cookie and a device's description.
    if let Some((events, uri)) = unsafe { about(info, cookie) }
        && state == DEVICE_STATE_EOF
    {
        lock(&events.ended).insert(uri);
    }
}
