//! Functions of the driver and of its devices.

use core::ffi::{CStr, c_char, c_int, c_void};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use plumb_openni::sys::*;

use super::{value, write};
use crate::device::{Device, Library, Stream, describe};
use crate::{CONTROL_VARIABLE, SCHEME};

/// Callbacks of the library.
static LIBRARY: Mutex<Option<Library>> = Mutex::new(None);

fn library() -> Option<Library> {
    *LIBRARY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Informs the library that the camera of `uri` is plugged in.
fn connect(uri: &str) -> OniStatus {
    let Some(library) = library() else { return STATUS_ERROR };
    let info = describe(uri);
    // SAFETY: the library supplied this callback and cookie for this purpose; the description lives
    // until the call returns.
    unsafe { (library.connected)(&raw const info, library.cookie) };
    STATUS_OK
}

/// Returns the path of the control file in a URI of this driver.
///
/// # Safety
/// `uri` is a string with a closing zero that does not change while the result is used.
unsafe fn path<'a>(uri: *const c_char) -> Option<&'a str> {
    // SAFETY: guaranteed by the caller.
    unsafe { CStr::from_ptr(uri) }.to_str().ok()?.strip_prefix(SCHEME)
}

driver! {
    /// Called when the driver is loaded.
    fn oniDriverCreate(_services: *mut c_void) {}

    /// Called before the driver is unloaded.
    fn oniDriverDestroy() {}

    /// Starts the driver, with callbacks for cameras that are connected, disconnected or changed.
    fn oniDriverInitialize(
        connected: DeviceCallback,
        disconnected: DeviceCallback,
        _changed: DeviceStateCallback,
        cookie: *mut c_void
    ) -> OniStatus {
        let library = Library { connected, disconnected, cookie };
        *LIBRARY.lock().unwrap_or_else(PoisonError::into_inner) = Some(library);
        match std::env::var(CONTROL_VARIABLE) {
            Ok(path) => connect(&format!("{SCHEME}{path}")),
            Err(_) => STATUS_OK,
        }
    }

    /// Checks that a URI is of a camera of this driver.
    fn oniDriverTryDevice(uri: *const c_char) -> OniStatus {
        // SAFETY: the library passes a string.
        match unsafe { path(uri) } {
            Some(path) if Path::new(path).exists() => connect(&format!("{SCHEME}{path}")),
            _ => STATUS_ERROR,
        }
    }

    /// Opens a camera.
    fn oniDriverDeviceOpen(uri: *const c_char, _mode: *const c_char) -> *mut Device {
        // SAFETY: the library passes a string.
        let Some(path) = (unsafe { path(uri) }) else { return std::ptr::null_mut() };
        let device = Device::open(&format!("{SCHEME}{path}"), path, library());
        device.map_or(std::ptr::null_mut(), |device| Box::into_raw(Box::new(device)))
    }

    /// Closes a camera.
    fn oniDriverDeviceClose(device: *mut Device) {
        // SAFETY: the handle is from `oniDriverDeviceOpen`, and is not used after this.
        drop(unsafe { Box::from_raw(device) });
    }

    /// Returns the camera's sensors.
    fn oniDriverDeviceGetSensorInfoList(
        device: *mut Device, infos: *mut *mut OniSensorInfo, count: *mut c_int
    ) -> OniStatus {
        // SAFETY: the handle is a camera's.
        let list = unsafe { &mut *device }.infos();
        // SAFETY: both are variables of the library.
        unsafe { (*infos, *count) = (list.as_mut_ptr(), list.len() as c_int) };
        STATUS_OK
    }

    /// Creates a stream.
    fn oniDriverDeviceCreateStream(device: *mut Device, sensor: c_int) -> *mut Stream {
        match sensor {
            // SAFETY: the handle is a camera's.
            SENSOR_COLOUR | SENSOR_DEPTH => unsafe { &*device }.create_stream(sensor),
            _ => std::ptr::null_mut(),
        }
    }

    /// Destroys a stream.
    fn oniDriverDeviceDestroyStream(device: *mut Device, stream: *mut Stream) {
        // SAFETY: the handles are those of a camera and its stream, which is not used after this.
        unsafe { (*device).destroy_stream(stream) };
    }

    /// Sets a property of the camera.
    fn oniDriverDeviceSetProperty(
        device: *mut Device, property: c_int, data: *const c_void, size: c_int
    ) -> OniStatus {
        // SAFETY: the buffer has the given size.
        let Some(value) = (unsafe { value::<c_int>(data, size) }) else {
            return STATUS_BAD_PARAMETER;
        };
        if property != DEVICE_PROPERTY_REGISTRATION {
            return STATUS_NOT_SUPPORTED;
        }
        // SAFETY: the handle is a camera's.
        unsafe { &*device }.set_registration(value);
        STATUS_OK
    }

    /// Returns a property of the camera.
    fn oniDriverDeviceGetProperty(
        device: *mut Device, property: c_int, data: *mut c_void, size: *mut c_int
    ) -> OniStatus {
        if property != DEVICE_PROPERTY_REGISTRATION {
            return STATUS_NOT_SUPPORTED;
        }
        // SAFETY: the handle is a camera's.
        let value = unsafe { &*device }.registration();
        // SAFETY: the buffer has the given size.
        unsafe { write(data, size, value) }
    }

    /// Returns whether the camera has a property.
    fn oniDriverDeviceIsPropertySupported(_device: *mut Device, property: c_int) -> c_int {
        c_int::from(property == DEVICE_PROPERTY_REGISTRATION)
    }

    /// Registers a callback for changes of properties. No property changes by itself.
    fn oniDriverDeviceSetPropertyChangedCallback(
        _device: *mut Device, _handler: *mut c_void, _cookie: *mut c_void
    ) {}

    /// Notifies the callback of all properties. It has no effect.
    fn oniDriverDeviceNotifyAllProperties(_device: *mut Device) {}

    /// Executes a command. There are none.
    fn oniDriverDeviceInvoke(
        _device: *mut Device, _command: c_int, _data: *mut c_void, _size: c_int
    ) -> OniStatus {
        STATUS_NOT_SUPPORTED
    }

    /// Returns whether a command is supported. There are none.
    fn oniDriverDeviceIsCommandSupported(_device: *mut Device, _command: c_int) -> c_int {
        0
    }

    /// Called before the library waits for a frame. Frames arrive without it.
    fn oniDriverDeviceTryManualTrigger(_device: *mut Device) -> OniStatus {
        STATUS_OK
    }

    /// Returns whether a mode of registration is supported.
    fn oniDriverDeviceIsImageRegistrationModeSupported(device: *mut Device, mode: c_int) -> c_int {
        // SAFETY: the handle is a camera's.
        let can = !unsafe { &*device }.control().no_registration;
        c_int::from(mode == REGISTRATION_OFF || (can && mode == REGISTRATION_DEPTH_TO_COLOUR))
    }
}
