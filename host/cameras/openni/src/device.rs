//! An open camera or recording, and its pictures as they come.

use core::ffi::c_int;
use std::path::Path;
use std::time::Duration;

use crate::camera::{Settings, Target};
use crate::handle::Handle;
use crate::library::OpenNi;
use crate::picture::{Picture, Raw, Sensor};
use crate::stream::{Bare, Stream};
use crate::{OpenniError, oni_file, sys};

/// A device and its two streams. Its handles are used by one thread only.
pub(crate) struct Device {
    openni: OpenNi,
    handle: sys::OniDeviceHandle,
    pub(crate) uri: String,
    pub(crate) name: String,
    pub(crate) colour: Stream,
    pub(crate) depth: Stream,
    synchronised: bool,
    recording: bool,
    /// Given up without being closed: what it was is gone.
    abandoned: bool,
}

impl Device {
    /// Opens `target`, sets it up and verifies that it is so; nothing is started.
    pub(crate) fn open(
        openni: &OpenNi,
        target: &Target,
        settings: &Settings,
    ) -> Result<Self, OpenniError> {
        let uri = match target {
            Target::First => first(openni)?,
            Target::Uri(uri) => uri.clone(),
            Target::Recording(path) => readable(path)?,
        };
        openni.inner.events.begin(&uri);
        let handle = Handle::open(openni, &uri)?;
        let name = handle.name();
        let (colour, depth) = match target {
            Target::Recording(_) => handle.recorded_streams(&uri)?,
            Target::First | Target::Uri(_) => handle.live_streams(&uri, settings)?,
        };
        let handle = handle.into_raw();
        let recording = matches!(target, Target::Recording(_));
        let (openni, synchronised, abandoned) = (openni.clone(), false, false);
        Ok(Self { openni, handle, uri, name, colour, depth, synchronised, recording, abandoned })
    }

    /// The stream of `sensor`.
    fn stream(&self, sensor: Sensor) -> &Stream {
        match sensor {
            Sensor::Colour => &self.colour,
            Sensor::Depth => &self.depth,
        }
    }

    /// The stream's handle, for the recorder.
    pub(crate) fn stream_handle(&self, sensor: Sensor) -> sys::OniStreamHandle {
        self.stream(sensor).handle
    }

    /// The library.
    pub(crate) fn openni(&self) -> &OpenNi {
        &self.openni
    }

    /// Lets the pictures come.
    pub(crate) fn start(&self) -> Result<(), OpenniError> {
        for stream in [&self.depth, &self.colour] {
            // SAFETY: the stream is the device's and is destroyed only with it.
            let status = unsafe { (self.openni.inner.api.stream_start)(stream.handle) };
            self.set("the stream's start", status)?;
        }
        Ok(())
    }

    /// Asks the camera to take colour and depth at one moment. To be called once, when both streams
    /// are started: the library frees its own memory twice otherwise.
    pub(crate) fn synchronise(&mut self) -> Result<(), OpenniError> {
        // SAFETY: the device is open.
        let status = unsafe { (self.openni.inner.api.enable_sync)(self.handle) };
        self.set("the synchronisation of depth and colour", status)?;
        self.synchronised = true;
        Ok(())
    }

    /// Whether colour and depth are taken at one moment.
    pub(crate) fn is_synchronised(&self) -> bool {
        self.synchronised
    }

    /// The field of view of the colour camera, horizontal and vertical, radians; `None` where it
    /// does not tell.
    pub(crate) fn field_of_view(&self) -> Option<(f64, f64)> {
        let stream = Bare { openni: &self.openni, raw: self.colour.handle };
        let angle = |property| {
            let value = f64::from(stream.get(property, 0.0_f32).ok()?);
            (value > 0.0 && value < std::f64::consts::PI).then_some(value)
        };
        Some((
            angle(sys::STREAM_PROPERTY_HORIZONTAL_FOV)?,
            angle(sys::STREAM_PROPERTY_VERTICAL_FOV)?,
        ))
    }

    /// How many pictures of `sensor` a recording says that it has; 0 where it was not finished.
    pub(crate) fn promised(&self, sensor: Sensor) -> i32 {
        let stream = Bare { openni: &self.openni, raw: self.stream(sensor).handle };
        stream.get(sys::STREAM_PROPERTY_NUMBER_OF_FRAMES, 0).unwrap_or(0).max(0)
    }

    /// The next picture of either stream, as it came; `None` where none comes within `timeout`.
    ///
    /// # Errors
    /// Where the library fails, or the picture is not of the stream's mode.
    pub(crate) fn next(&self, timeout: Duration) -> Result<Option<Picture>, OpenniError> {
        let api = &self.openni.inner.api;
        let mut streams = [self.depth.handle, self.colour.handle];
        let mut index = -1;
        let milliseconds = c_int::try_from(timeout.as_millis()).unwrap_or(c_int::MAX);
        // SAFETY: both streams live, and the library writes nothing but the index.
        let status = unsafe { (api.wait)(streams.as_mut_ptr(), 2, &raw mut index, milliseconds) };
        if status == sys::STATUS_TIME_OUT {
            return Ok(None);
        }
        self.set("the wait for a picture", status)?;
        let stream = if index == 0 { &self.depth } else { &self.colour };
        let mut frame = std::ptr::null_mut();
        // SAFETY: the stream lives and has a picture, so that this does not block.
        let status = unsafe { (api.read_frame)(stream.handle, &raw mut frame) };
        self.set("the reading of a picture", status)?;
        // SAFETY: the library hands over a reference to a picture, or null; it is released below.
        let Some(read) = (unsafe { frame.as_ref() }) else { return Ok(None) };
        let picture = unpack(read, stream);
        // SAFETY: the picture is released once, and `read` is not used any more.
        unsafe { (api.release_frame)(frame) };
        picture.map(Some)
    }

    /// Gives the device up as it is. Nobody knows what a driver makes of being told to stop a
    /// camera that is not there.
    pub(crate) fn abandon(&mut self) {
        self.abandoned = true;
    }

    /// `status` of what was done to the device.
    fn set(&self, what: &'static str, status: sys::OniStatus) -> Result<(), OpenniError> {
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
            // SAFETY: the stream lives; a stream that was not started may be stopped.
            unsafe { (api.stream_stop)(stream.handle) };
        }
        // The player of recordings goes through its streams, in a thread of its own and without a
        // lock, until it is closed: they are left to it.
        let owned: &[&Stream] = if self.recording { &[] } else { &[&self.depth, &self.colour] };
        for stream in owned {
            // SAFETY: the stream lives, and is not used after this.
            unsafe { (api.stream_destroy)(stream.handle) };
        }
        // SAFETY: the device is open, and is not used after this.
        unsafe { (api.device_close)(self.handle) };
    }
}

/// The picture out of the library's memory.
fn unpack(frame: &sys::OniFrame, stream: &Stream) -> Result<Picture, OpenniError> {
    let length = usize::try_from(frame.data_size).unwrap_or(0);
    let bytes = if frame.data.is_null() {
        &[]
    } else {
        // SAFETY: the library says that so many bytes are there; they stay until the frame is
        // released.
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

/// The first camera there is.
fn first(openni: &OpenNi) -> Result<String, OpenniError> {
    let first = openni.devices()?.into_iter().next();
    first.map(|device| device.uri).ok_or(OpenniError::NoDevice)
}

/// The path of a recording that can be read, as the library takes it.
fn readable(path: &Path) -> Result<String, OpenniError> {
    let uri = path.display().to_string();
    let failed = |error: String| OpenniError::Open { uri: uri.clone(), error };
    oni_file::examine(path).map_err(|error| failed(error.to_string()))?;
    match path.to_str() {
        Some(text) => Ok(text.to_owned()),
        None => Err(failed("OpenNI2 takes paths in UTF-8 only".to_owned())),
    }
}
