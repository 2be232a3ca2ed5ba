//! Functions of streams.

use core::ffi::{c_int, c_void};

use plumb_openni::sys::*;

use super::{value, write};
use crate::device::{FrameCallback, Stream, StreamServices};
use crate::render::FOCAL_LENGTH;

driver! {
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
