//! Open camera or recording with its two streams.

use core::ffi::c_int;
use std::path::Path;
use std::time::Duration;

use plumb_frame::pairing::Sensor;

use crate::error::OpenniError;
use crate::handle::Handle;
use crate::library::OpenNi;
use crate::picture::{Picture, Raw};
use crate::settings::{Settings, Target};
use crate::stream::{RawStream, Stream};
use crate::{oni_file, sys};

/// Device with its two streams. One thread only uses its handles.
pub(crate) struct Device {
    openni: OpenNi,
    handle: sys::OniDeviceHandle,
    pub(crate) uri: String,
    pub(crate) name: String,
    pub(crate) colour: Stream,
    pub(crate) depth: Stream,
    synchronised: bool,
    recording: bool,
    /// Whether the device is left open when it is dropped.
    abandoned: bool,
}

impl Device {
    /// Opens `target` with `settings`, and verifies them. The streams are not started.
    pub(crate) fn open(
        openni: &OpenNi,
        target: &Target,
        settings: &Settings,
    ) -> Result<Self, OpenniError> {
        let uri = match target {
            Target::First => first(openni)?,
            Target::Uri(uri) => uri.clone(),
            Target::Recording(path) => checked_path(path)?,
        };
        openni.inner.events.reset(&uri);
        let handle = Handle::open(openni, &uri)?;
        let name = handle.name();
        let (colour, depth) = match target {
            Target::Recording(_) => handle.recorded_streams(&uri)?,
            Target::First | Target::Uri(_) => handle.live_streams(&uri, settings)?,
        };
        let handle = handle.into_raw();
        let recording = target.is_recording();
        let (openni, synchronised, abandoned) = (openni.clone(), false, false);
        Ok(Self { openni, handle, uri, name, colour, depth, synchronised, recording, abandoned })
    }

    /// Returns the stream of `sensor`.
    fn stream(&self, sensor: Sensor) -> &Stream {
        match sensor {
            Sensor::Colour => &self.colour,
            Sensor::Depth => &self.depth,
        }
    }

    /// Returns the handle of a stream, for the recorder.
    pub(crate) fn stream_handle(&self, sensor: Sensor) -> sys::OniStreamHandle {
        self.stream(sensor).handle
    }

    /// Returns the library.
    pub(crate) fn openni(&self) -> &OpenNi {
        &self.openni
    }

    /// Returns whether the camera was unplugged.
    pub(crate) fn is_unplugged(&self) -> bool {
        self.openni.inner.events.is_unplugged(&self.uri)
    }

    /// Returns whether the recording was played to its end.
    pub(crate) fn has_ended(&self) -> bool {
        self.openni.inner.events.has_ended(&self.uri)
    }

    /// Starts both streams.
    pub(crate) fn start(&self) -> Result<(), OpenniError> {
        for stream in [&self.depth, &self.colour] {
            // SAFETY: the stream lives as long as the device.
            let status = unsafe { (self.openni.inner.api.stream_start)(stream.handle) };
            self.check("the stream's start", status)?;
        }
        Ok(())
    }

    /// Makes the camera take colour and depth at the same moment. Must be called once, after both
    /// streams are started: else the library frees its own memory twice.
    pub(crate) fn synchronise(&mut self) -> Result<(), OpenniError> {
        // SAFETY: the device is open.
        let status = unsafe { (self.openni.inner.api.enable_sync)(self.handle) };
        self.check("the synchronisation of depth and colour", status)?;
        self.synchronised = true;
        Ok(())
    }

    /// Returns whether colour and depth are taken at the same moment.
    pub(crate) fn is_synchronised(&self) -> bool {
        self.synchronised
    }

    /// Returns the horizontal and vertical field of view of the colour camera, radians; `None`
    /// where the device does not state it.
    pub(crate) fn field_of_view(&self) -> Option<(f64, f64)> {
        let stream = RawStream { openni: &self.openni, raw: self.colour.handle };
        let angle = |property| {
            let value = f64::from(stream.get(property, 0.0_f32).ok()?);
            (value > 0.0 && value < std::f64::consts::PI).then_some(value)
        };
        Some((
            angle(sys::STREAM_PROPERTY_HORIZONTAL_FOV)?,
            angle(sys::STREAM_PROPERTY_VERTICAL_FOV)?,
        ))
    }

    /// Returns the number of pictures of `sensor` that a recording states; 0 where it was not
    /// completed.
    pub(crate) fn promised(&self, sensor: Sensor) -> i32 {
        let stream = RawStream { openni: &self.openni, raw: self.stream(sensor).handle };
        stream.get(sys::STREAM_PROPERTY_NUMBER_OF_FRAMES, 0).unwrap_or(0).max(0)
    }

    /// Returns the next picture of either stream; `None` where none comes within `timeout`.
    ///
    /// # Errors
    /// Where the library fails, or the picture does not have the stream's mode.
    pub(crate) fn next(&self, timeout: Duration) -> Result<Option<Picture>, OpenniError> {
        let api = &self.openni.inner.api;
        let mut streams = [self.depth.handle, self.colour.handle];
        let mut index = -1;
        let milliseconds = c_int::try_from(timeout.as_millis()).unwrap_or(c_int::MAX);
        // SAFETY: both streams live, and the library writes the index only.
        let status = unsafe { (api.wait)(streams.as_mut_ptr(), 2, &raw mut index, milliseconds) };
        if status == sys::STATUS_TIME_OUT {
            return Ok(None);
        }
        self.check("the wait for a picture", status)?;
        let stream = if index == 0 { &self.depth } else { &self.colour };
        let mut frame = std::ptr::null_mut();
        // SAFETY: the stream lives. It has a picture, so that the call does not block.
        let status = unsafe { (api.read_frame)(stream.handle, &raw mut frame) };
        self.check("the reading of a picture", status)?;
        // SAFETY: the library returns a picture, which is released below, or null.
        let Some(read) = (unsafe { frame.as_ref() }) else { return Ok(None) };
        let picture = unpack(read, stream);
        // SAFETY: the picture is released once, and `read` is not used after this.
        unsafe { (api.release_frame)(frame) };
        picture.map(Some)
    }

    /// Leaves the device open when it is dropped. Stopping an unplugged camera is undefined in some
    /// drivers.
    pub(crate) fn abandon(&mut self) {
        self.abandoned = true;
    }

    /// Returns the error of a failed call.
    fn check(&self, what: &'static str, status: sys::OniStatus) -> Result<(), OpenniError> {
        let uri = || self.uri.clone();
        self.openni.inner.check(status).map_err(|error| OpenniError::Setting {
            uri: uri(),
            what,
            error,
        })
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if self.abandoned {
            return;
        }
        let api = &self.openni.inner.api;
        if self.synchronised {
            // SAFETY: the device is open and synchronised.
            unsafe { (api.disable_sync)(self.handle) };
        }
        for stream in [&self.depth, &self.colour] {
            // SAFETY: the stream lives; a stream may be stopped before it was started.
            unsafe { (api.stream_stop)(stream.handle) };
        }
        // The library's player reads its streams in a thread of its own, without a lock, until the
        // device is closed: it destroys them itself.
        let owned: &[&Stream] = if self.recording { &[] } else { &[&self.depth, &self.colour] };
        for stream in owned {
            // SAFETY: the stream lives, and is not used after this.
            unsafe { (api.stream_destroy)(stream.handle) };
        }
        // SAFETY: the device is open, and is not used after this.
        unsafe { (api.device_close)(self.handle) };
    }
}

/// Copies a picture out of the library's memory.
fn unpack(frame: &sys::OniFrame, stream: &Stream) -> Result<Picture, OpenniError> {
    let length = usize::try_from(frame.data_size).unwrap_or(0);
    let bytes = if frame.data.is_null() {
        &[]
    } else {
        // SAFETY: the frame has `data_size` bytes, which stay until it is released.
        unsafe { std::slice::from_raw_parts(frame.data.cast::<u8>(), length) }
    };
    let raw = Raw {
        sensor: stream.sensor,
        index: frame.frame_index,
        timestamp: frame.timestamp,
        width: frame.width,
        height: frame.height,
        stride: frame.stride,
        cropped: frame.cropping_enabled != 0,
        bytes,
    };
    raw.unpack(&stream.mode, stream.mirrored)
}

/// Returns the URI of the first camera.
fn first(openni: &OpenNi) -> Result<String, OpenniError> {
    let first = openni.devices()?.into_iter().next();
    first.map(|device| device.uri).ok_or(OpenniError::NoDevice)
}

/// Checks that a recording can be read. Returns its path in the library's form.
fn checked_path(path: &Path) -> Result<String, OpenniError> {
    let uri = path.display().to_string();
    let failed = |error: String| OpenniError::Open { uri: uri.clone(), error };
    oni_file::check(path).map_err(|error| failed(error.to_string()))?;
    match path.to_str() {
        Some(text) => Ok(text.to_owned()),
        None => Err(failed("OpenNI2 takes paths in UTF-8 only".to_owned())),
    }
}
