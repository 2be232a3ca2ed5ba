//! Functions of a driver that OpenNI2 calls (`OniDriverAPI.h`, 2.2).

use core::ffi::{CStr, c_char, c_int, c_void};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use plumb_openni::sys::*;

use crate::device::{Device, FrameCallback, Library, Stream, StreamServices, describe};
use crate::render::FOCAL_LENGTH;
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

    /// Sets the library's services for a stream.
    fn oniDriverStreamSetServices(stream: *mut Stream, services: *const StreamServices) {
        // SAFETY: the handle is a stream's, which is not started.
        unsafe { &mut *stream }.set_services(services);
    }

    /// Sets a property of a stream.
    fn oniDriverStreamSetProperty(
        stream: *mut Stream, property: c_int, data: *const c_void, size: c_int
    ) -> OniStatus {
        // SAFETY: the handle is a stream's, which is not started.
        let stream = unsafe { &mut *stream };
        let done = match property {
            STREAM_PROPERTY_VIDEO_MODE => {
                // SAFETY: the buffer has the given size.
                unsafe { value(data, size) }.map(|mode| stream.set_mode(mode))
            }
            STREAM_PROPERTY_MIRRORING => {
                // SAFETY: as above.
                unsafe { value(data, size) }.map(|on: c_int| stream.set_mirrored(on != 0))
            }
            _ => return STATUS_NOT_SUPPORTED,
        };
        if done == Some(true) { STATUS_OK } else { STATUS_BAD_PARAMETER }
    }

    /// Returns a property of a stream.
    fn oniDriverStreamGetProperty(
        stream: *mut Stream, property: c_int, data: *mut c_void, size: *mut c_int
    ) -> OniStatus {
        // SAFETY: the handle is a stream's.
        let stream = unsafe { &*stream };
        let mode = stream.mode();
        let angle = |length: f64| (2.0 * (length / 2.0 / FOCAL_LENGTH).atan()) as f32;
        match property {
            // The player returns no frames of a recording without cropping.
            STREAM_PROPERTY_CROPPING => {
                let (width, height) = (mode.resolution_x, mode.resolution_y);
                let cropping = OniCropping { width, height, ..OniCropping::default() };
                // SAFETY: the buffer has the given size.
                unsafe { write(data, size, cropping) }
            }
            // SAFETY: as above.
            STREAM_PROPERTY_HORIZONTAL_FOV => unsafe { write(data, size, angle(640.0)) },
            // SAFETY: as above.
            STREAM_PROPERTY_VERTICAL_FOV => unsafe { write(data, size, angle(480.0)) },
            // SAFETY: as above.
            STREAM_PROPERTY_VIDEO_MODE => unsafe { write(data, size, mode) },
            // SAFETY: as above.
            STREAM_PROPERTY_MAX_VALUE if stream.sensor() == SENSOR_DEPTH => unsafe {
                write(data, size, 10_000)
            },
            // SAFETY: as above.
            STREAM_PROPERTY_MIRRORING => unsafe {
                write(data, size, c_int::from(stream.mirrored()))
            },
            _ => STATUS_NOT_SUPPORTED,
        }
    }

    /// Returns whether the stream has a property.
    fn oniDriverStreamIsPropertySupported(_stream: *mut Stream, property: c_int) -> c_int {
        c_int::from((STREAM_PROPERTY_CROPPING..=STREAM_PROPERTY_MIRRORING).contains(&property))
    }

    /// Registers a callback for changes of properties. No property changes by itself.
    fn oniDriverStreamSetPropertyChangedCallback(
        _stream: *mut Stream, _handler: *mut c_void, _cookie: *mut c_void
    ) {}

    /// Notifies the callback of all properties. It has no effect.
    fn oniDriverStreamNotifyAllProperties(_stream: *mut Stream) {}

    /// Executes a command. There are none.
    fn oniDriverStreamInvoke(
        _stream: *mut Stream, _command: c_int, _data: *mut c_void, _size: c_int
    ) -> OniStatus {
        STATUS_NOT_SUPPORTED
    }

    /// Returns whether a command is supported. There are none.
    fn oniDriverStreamIsCommandSupported(_stream: *mut Stream, _command: c_int) -> c_int {
        0
    }

    /// Starts a stream.
    fn oniDriverStreamStart(stream: *mut Stream) -> OniStatus {
        // SAFETY: the handle is a stream's.
        unsafe { &mut *stream }.set_started(true);
        STATUS_OK
    }

    /// Stops a stream.
    fn oniDriverStreamStop(stream: *mut Stream) {
        // SAFETY: the handle is a stream's.
        unsafe { &mut *stream }.set_started(false);
    }

    /// Returns the size of a frame, bytes.
    fn oniDriverStreamGetRequiredFrameSize(stream: *mut Stream) -> c_int {
        // SAFETY: the handle is a stream's.
        unsafe { &*stream }.bytes()
    }

    /// Registers the callback for new frames.
    fn oniDriverStreamSetNewFrameCallback(
        stream: *mut Stream, handler: Option<FrameCallback>, cookie: *mut c_void
    ) {
        // SAFETY: the handle is a stream's, which is not started.
        unsafe { &mut *stream }.set_callback(handler, cookie);
    }

    /// Converts a depth pixel to a colour pixel: the same pixel, because depth is registered.
    fn oniDriverStreamConvertDepthToColorCoordinates(
        _depth: *mut Stream,
        _colour: *mut Stream,
        x: c_int,
        y: c_int,
        _z: u16,
        u: *mut c_int,
        v: *mut c_int
    ) -> OniStatus {
        // SAFETY: both are variables of the library.
        unsafe { (*u, *v) = (x, y) };
        STATUS_OK
    }

    /// Synchronises the frames of streams. They always are.
    fn oniDriverEnableFrameSync(streams: *mut *mut Stream, count: c_int) -> *mut c_void {
        // SAFETY: the library passes `count` streams.
        let streams = unsafe { std::slice::from_raw_parts(streams, count as usize) };
        // SAFETY: the handles are streams'.
        if streams.iter().any(|&stream| unsafe { &*stream }.control().no_sync) {
            return std::ptr::null_mut();
        }
        // Any other pointer means success.
        std::ptr::dangling_mut()
    }

    /// Ends the synchronisation. It has no effect.
    fn oniDriverDisableFrameSync(_group: *mut c_void) {}
}

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
