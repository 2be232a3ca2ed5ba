//! Streams of a camera or a recording.

use core::ffi::{c_int, c_void};

use plumb_frame::pairing::Sensor;

use crate::error::OpenniError;
use crate::library::OpenNi;
use crate::settings::{Mode, formats};
use crate::sys;

/// Stream of a device.
pub(crate) struct Stream {
    pub(crate) sensor: Sensor,
    pub(crate) handle: sys::OniStreamHandle,
    pub(crate) mode: Mode,
    /// Whether left and right are exchanged in its pictures.
    pub(crate) mirrored: bool,
}

/// Stream that is being set up.
pub(crate) struct RawStream<'a> {
    pub(crate) openni: &'a OpenNi,
    pub(crate) raw: sys::OniStreamHandle,
}

/// Type of a property for which any bytes are a value.
pub(crate) trait Plain: Copy {}
impl Plain for c_int {}
impl Plain for f32 {}
impl Plain for sys::OniVideoMode {}

impl RawStream<'_> {
    /// Destroys the stream. It must not be used afterwards.
    pub(crate) fn destroy(&self) {
        // SAFETY: the stream lives, and is not used after this.
        unsafe { (self.openni.inner.api.stream_destroy)(self.raw) };
    }

    fn set<T: Plain>(&self, property: c_int, value: T) -> Result<(), String> {
        let size = size_of::<T>() as c_int;
        let pointer = std::ptr::from_ref(&value).cast::<c_void>();
        // SAFETY: the stream lives; the pointer is to `size` bytes of a plain value.
        let status =
            unsafe { (self.openni.inner.api.stream_set)(self.raw, property, pointer, size) };
        self.openni.inner.check(status)
    }

    /// Returns the value of a property. `zero` is any value.
    pub(crate) fn get<T: Plain>(&self, property: c_int, zero: T) -> Result<T, String> {
        let (mut value, mut size) = (zero, size_of::<T>() as c_int);
        let pointer = (&raw mut value).cast::<c_void>();
        // SAFETY: the stream lives; the library writes at most `size` bytes, and any bytes make a
        // `T`.
        let status = unsafe {
            (self.openni.inner.api.stream_get)(self.raw, property, pointer, &raw mut size)
        };
        self.openni.inner.check(status).map(|()| value)
    }

    /// Sets the mode, turns mirroring off, and verifies both.
    pub(crate) fn set_up(&self, uri: &str, mode: Mode) -> Result<(), OpenniError> {
        let failed = |what, error| OpenniError::Setting { uri: uri.to_owned(), what, error };
        let size = |error| failed("size and rate", error);
        self.set(sys::STREAM_PROPERTY_VIDEO_MODE, mode.raw()).map_err(size)?;
        let is = self
            .get(sys::STREAM_PROPERTY_VIDEO_MODE, sys::OniVideoMode::default())
            .map_err(size)?;
        if is != mode.raw() {
            let text =
                Mode::from_raw(&is).map_or_else(|| "no mode".to_owned(), |mode| mode.to_string());
            return Err(size(format!("{mode} was accepted, but it is {text}")));
        }
        // A camera without this property does not mirror.
        let set = self.set(sys::STREAM_PROPERTY_MIRRORING, 0_i32);
        match self.get(sys::STREAM_PROPERTY_MIRRORING, 0_i32) {
            Ok(0) | Err(_) => Ok(()),
            Ok(_) => Err(failed(
                "mirroring off",
                set.err().unwrap_or_else(|| "it is still on".to_owned()),
            )),
        }
    }

    /// Returns the stream of a recording with its recorded mode.
    pub(crate) fn recorded(&self, uri: &str, sensor: Sensor) -> Result<Stream, OpenniError> {
        let failed = |error: String| OpenniError::Open { uri: format!("{uri}, {sensor}"), error };
        let raw = self
            .get(sys::STREAM_PROPERTY_VIDEO_MODE, sys::OniVideoMode::default())
            .map_err(failed)?;
        let mode = Mode::from_raw(&raw).ok_or_else(|| failed("it has no size".to_owned()))?;
        if !formats(sensor).contains(&mode.format) {
            return Err(failed(format!(
                "recorded as {mode}: record it as RGB and depth in millimetres"
            )));
        }
        let mirrored = self.get(sys::STREAM_PROPERTY_MIRRORING, 0_i32).unwrap_or(0) != 0;
        Ok(Stream { sensor, handle: self.raw, mode, mirrored })
    }
}
