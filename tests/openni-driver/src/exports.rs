//! What OpenNI2 calls of a driver (`OniDriverAPI.h`, 2.2).

use core::ffi::{CStr, c_char, c_int, c_void};
use std::sync::{Mutex, PoisonError};

use plumb_openni::sys::*;

use crate::device::{Device, FrameCallback, Library, Stream, StreamServices, describe};
use crate::render::FOCAL_LENGTH;
use crate::{CONTROL_VARIABLE, SCHEME};

/// What the library said of itself.
static LIBRARY: Mutex<Option<Library>> = Mutex::new(None);

fn library() -> Option<Library> {
    *LIBRARY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Tells the library that the camera of `uri` is plugged in.
fn connect(uri: &str) -> OniStatus {
    let Some(library) = library() else { return STATUS_ERROR };
    let info = describe(uri);
    // SAFETY: the library gave this callback and cookie for this; the description lives through the
    // call.
    unsafe { (library.connected)(&raw const info, library.cookie) };
    STATUS_OK
}

/// The control file's path in a URI of this driver's.
///
/// # Safety
/// `uri` is a string with a closing zero that stays as it is while the answer is used.
unsafe fn path<'a>(uri: *const c_char) -> Option<&'a str> {
    // SAFETY: as this function's caller promises.
    unsafe { CStr::from_ptr(uri) }.to_str().ok()?.strip_prefix(SCHEME)
}

/// Declares functions of a driver; every one of them is called by the library only, with pointers
/// that are valid by the interface's rules: handles are those that this driver gave and that were
/// not closed, and a property's buffer has the size that is said beside it.
macro_rules! driver {
    ($($(#[$doc:meta])* fn $name:ident($($argument:ident: $type:ty),*) $(-> $answer:ty)? $body:block)*) => {$(
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
    /// The driver is loaded.
    fn oniDriverCreate(_services: *mut c_void) {}

    /// The driver is to end.
    fn oniDriverDestroy() {}

    /// Begins, with callbacks for cameras that come, go, and change.
    fn oniDriverInitialize(
        connected: DeviceCallback, disconnected: DeviceCallback, _changed: DeviceStateCallback, cookie: *mut c_void
    ) -> OniStatus {
        let library = Library { connected, disconnected, cookie };
        *LIBRARY.lock().unwrap_or_else(PoisonError::into_inner) = Some(library);
        match std::env::var(CONTROL_VARIABLE) {
            Ok(path) => connect(&format!("{SCHEME}{path}")),
            Err(_) => STATUS_OK,
        }
    }

    /// Is this URI of a camera of this driver's?
    fn oniDriverTryDevice(uri: *const c_char) -> OniStatus {
        // SAFETY: the library gives a string.
        match unsafe { path(uri) } {
            Some(path) if std::path::Path::new(path).exists() => connect(&format!("{SCHEME}{path}")),
            _ => STATUS_ERROR,
        }
    }

    /// Opens a camera.
    fn oniDriverDeviceOpen(uri: *const c_char, _mode: *const c_char) -> *mut Device {
        // SAFETY: the library gives a string.
        let Some(path) = (unsafe { path(uri) }) else { return std::ptr::null_mut() };
        let device = Device::open(&format!("{SCHEME}{path}"), path, library());
        device.map_or(std::ptr::null_mut(), |device| Box::into_raw(Box::new(device)))
    }

    /// Closes a camera.
    fn oniDriverDeviceClose(device: *mut Device) {
        // SAFETY: it was made by `oniDriverDeviceOpen`, and is not used after this.
        drop(unsafe { Box::from_raw(device) });
    }

    /// The camera's sensors.
    fn oniDriverDeviceGetSensorInfoList(
        device: *mut Device, infos: *mut *mut OniSensorInfo, count: *mut c_int
    ) -> OniStatus {
        // SAFETY: the handle is a camera's.
        let list = unsafe { &mut *device }.infos();
        // SAFETY: both are variables of the library's.
        unsafe { (*infos, *count) = (list.as_mut_ptr(), list.len() as c_int) };
        STATUS_OK
    }

    /// Makes a stream.
    fn oniDriverDeviceCreateStream(device: *mut Device, sensor: c_int) -> *mut Stream {
        match sensor {
            // SAFETY: the handle is a camera's.
            SENSOR_COLOUR | SENSOR_DEPTH => unsafe { &*device }.create_stream(sensor),
            _ => std::ptr::null_mut(),
        }
    }

    /// Ends a stream.
    fn oniDriverDeviceDestroyStream(device: *mut Device, stream: *mut Stream) {
        // SAFETY: the handles are a camera's and its stream's, which is not used after this.
        unsafe { (*device).destroy_stream(stream) };
    }

    /// Sets a property of the camera.
    fn oniDriverDeviceSetProperty(
        device: *mut Device, property: c_int, data: *const c_void, size: c_int
    ) -> OniStatus {
        // SAFETY: the buffer has the size that is said beside it.
        let Some(value) = (unsafe { value::<c_int>(data, size) }) else { return STATUS_BAD_PARAMETER };
        if property != DEVICE_PROPERTY_REGISTRATION {
            return STATUS_NOT_SUPPORTED;
        }
        // SAFETY: the handle is a camera's.
        unsafe { &*device }.set_registration(value);
        STATUS_OK
    }

    /// Tells a property of the camera.
    fn oniDriverDeviceGetProperty(
        device: *mut Device, property: c_int, data: *mut c_void, size: *mut c_int
    ) -> OniStatus {
        if property != DEVICE_PROPERTY_REGISTRATION {
            return STATUS_NOT_SUPPORTED;
        }
        // SAFETY: the handle is a camera's.
        let value = unsafe { &*device }.registration();
        // SAFETY: the buffer has the size that is said beside it.
        unsafe { tell(data, size, value) }
    }

    /// Has the camera this property?
    fn oniDriverDeviceIsPropertySupported(_device: *mut Device, property: c_int) -> c_int {
        c_int::from(property == DEVICE_PROPERTY_REGISTRATION)
    }

    /// Who hears of properties that change: none does by itself.
    fn oniDriverDeviceSetPropertyChangedCallback(_device: *mut Device, _handler: *mut c_void, _cookie: *mut c_void) {}

    /// Tells every property to who hears of them.
    fn oniDriverDeviceNotifyAllProperties(_device: *mut Device) {}

    /// Commands: there are none.
    fn oniDriverDeviceInvoke(_device: *mut Device, _command: c_int, _data: *mut c_void, _size: c_int) -> OniStatus {
        STATUS_NOT_SUPPORTED
    }

    /// Commands: there are none.
    fn oniDriverDeviceIsCommandSupported(_device: *mut Device, _command: c_int) -> c_int {
        0
    }

    /// Somebody waits for a picture; they come by themselves.
    fn oniDriverDeviceTryManualTrigger(_device: *mut Device) -> OniStatus {
        STATUS_OK
    }

    /// Can depth be registered so?
    fn oniDriverDeviceIsImageRegistrationModeSupported(device: *mut Device, mode: c_int) -> c_int {
        // SAFETY: the handle is a camera's.
        let can = !unsafe { &*device }.control().no_registration;
        c_int::from(mode == REGISTRATION_OFF || (can && mode == REGISTRATION_DEPTH_TO_COLOUR))
    }

    /// The library's part of a stream.
    fn oniDriverStreamSetServices(stream: *mut Stream, services: *const StreamServices) {
        // SAFETY: the handle is a stream's, which is not started yet.
        unsafe { &mut *stream }.set_services(services);
    }

    /// Sets a property of a stream.
    fn oniDriverStreamSetProperty(
        stream: *mut Stream, property: c_int, data: *const c_void, size: c_int
    ) -> OniStatus {
        // SAFETY: the handle is a stream's, which is not started yet.
        let stream = unsafe { &mut *stream };
        let done = match property {
            // SAFETY: the buffer has the size that is said beside it.
            STREAM_PROPERTY_VIDEO_MODE => unsafe { value(data, size) }.map(|mode| stream.set_mode(mode)),
            // SAFETY: as above.
            STREAM_PROPERTY_MIRRORING => unsafe { value(data, size) }.map(|on: c_int| stream.set_mirrored(on != 0)),
            _ => return STATUS_NOT_SUPPORTED,
        };
        if done == Some(true) { STATUS_OK } else { STATUS_BAD_PARAMETER }
    }

    /// Tells a property of a stream.
    fn oniDriverStreamGetProperty(
        stream: *mut Stream, property: c_int, data: *mut c_void, size: *mut c_int
    ) -> OniStatus {
        // SAFETY: the handle is a stream's.
        let stream = unsafe { &*stream };
        let mode = stream.mode();
        let angle = |length: f64| (2.0 * (length / 2.0 / FOCAL_LENGTH).atan()) as f32;
        match property {
            // The player of recordings gives none where the recorder was not told the cropping.
            STREAM_PROPERTY_CROPPING => {
                let (width, height) = (mode.resolution_x, mode.resolution_y);
                // SAFETY: the buffer has the size that is said beside it.
                unsafe { tell(data, size, OniCropping { width, height, ..OniCropping::default() }) }
            }
            // SAFETY: as above.
            STREAM_PROPERTY_HORIZONTAL_FOV => unsafe { tell(data, size, angle(640.0)) },
            // SAFETY: as above.
            STREAM_PROPERTY_VERTICAL_FOV => unsafe { tell(data, size, angle(480.0)) },
            // SAFETY: as above.
            STREAM_PROPERTY_VIDEO_MODE => unsafe { tell(data, size, mode) },
            // SAFETY: as above.
            STREAM_PROPERTY_MAX_VALUE if stream.sensor() == SENSOR_DEPTH => unsafe { tell(data, size, 10_000) },
            // SAFETY: as above.
            STREAM_PROPERTY_MIRRORING => unsafe { tell(data, size, c_int::from(stream.mirrored())) },
            _ => STATUS_NOT_SUPPORTED,
        }
    }

    /// Has the stream this property?
    fn oniDriverStreamIsPropertySupported(_stream: *mut Stream, property: c_int) -> c_int {
        c_int::from((STREAM_PROPERTY_CROPPING..=STREAM_PROPERTY_MIRRORING).contains(&property))
    }

    /// Who hears of properties that change: none does by itself.
    fn oniDriverStreamSetPropertyChangedCallback(_stream: *mut Stream, _handler: *mut c_void, _cookie: *mut c_void) {}

    /// Tells every property to who hears of them.
    fn oniDriverStreamNotifyAllProperties(_stream: *mut Stream) {}

    /// Commands: there are none.
    fn oniDriverStreamInvoke(_stream: *mut Stream, _command: c_int, _data: *mut c_void, _size: c_int) -> OniStatus {
        STATUS_NOT_SUPPORTED
    }

    /// Commands: there are none.
    fn oniDriverStreamIsCommandSupported(_stream: *mut Stream, _command: c_int) -> c_int {
        0
    }

    /// Lets pictures come.
    fn oniDriverStreamStart(stream: *mut Stream) -> OniStatus {
        // SAFETY: the handle is a stream's.
        unsafe { &mut *stream }.set_started(true);
        STATUS_OK
    }

    /// Lets none come any more.
    fn oniDriverStreamStop(stream: *mut Stream) {
        // SAFETY: the handle is a stream's.
        unsafe { &mut *stream }.set_started(false);
    }

    /// Bytes of a picture.
    fn oniDriverStreamGetRequiredFrameSize(stream: *mut Stream) -> c_int {
        // SAFETY: the handle is a stream's.
        unsafe { &*stream }.bytes()
    }

    /// Who hears of new pictures.
    fn oniDriverStreamSetNewFrameCallback(stream: *mut Stream, handler: Option<FrameCallback>, cookie: *mut c_void) {
        // SAFETY: the handle is a stream's, which is not started yet.
        unsafe { &mut *stream }.set_callback(handler, cookie);
    }

    /// Where a depth pixel is in the colour picture: at the same place, since it is registered.
    fn oniDriverStreamConvertDepthToColorCoordinates(
        _depth: *mut Stream, _colour: *mut Stream, x: c_int, y: c_int, _z: u16, u: *mut c_int, v: *mut c_int
    ) -> OniStatus {
        // SAFETY: both are variables of the library's.
        unsafe { (*u, *v) = (x, y) };
        STATUS_OK
    }

    /// Takes the pictures of these streams at one moment, as it always does.
    fn oniDriverEnableFrameSync(streams: *mut *mut Stream, count: c_int) -> *mut c_void {
        // SAFETY: the library gives so many streams.
        let streams = unsafe { std::slice::from_raw_parts(streams, count as usize) };
        // SAFETY: the handles are streams'.
        if streams.iter().any(|&stream| unsafe { &*stream }.control().no_sync) {
            return std::ptr::null_mut();
        }
        // Any other pointer will do.
        std::ptr::dangling_mut()
    }

    /// Takes them as it likes.
    fn oniDriverDisableFrameSync(_group: *mut c_void) {}
}

/// The value of a property that is being set; `None` where it is of another size.
///
/// # Safety
/// `size` bytes are at `data`, and any bytes make a `T`.
unsafe fn value<T: Copy>(data: *const c_void, size: c_int) -> Option<T> {
    // SAFETY: as this function's caller promises; the library's buffers may lie anywhere.
    (size as usize == size_of::<T>()).then(|| unsafe { data.cast::<T>().read_unaligned() })
}

/// Tells a property's value.
///
/// # Safety
/// `*size` bytes may be written at `data`.
unsafe fn tell<T: Copy>(data: *mut c_void, size: *mut c_int, value: T) -> OniStatus {
    // SAFETY: as this function's caller promises.
    if unsafe { *size } as usize != size_of::<T>() {
        return STATUS_BAD_PARAMETER;
    }
    // SAFETY: as this function's caller promises; the library's buffers may lie anywhere.
    unsafe { data.cast::<T>().write_unaligned(value) };
    STATUS_OK
}
