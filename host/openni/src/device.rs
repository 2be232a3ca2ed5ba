//! An open camera or recording: set up as Plumb needs it, and checked that it is.

use core::ffi::{c_int, c_void};
use std::ffi::CString;
use std::path::Path;
use std::time::Duration;

use crate::camera::{Settings, Target};
use crate::events::text;
use crate::library::OpenNi;
use crate::picture::{Mode, Picture, Raw, Sensor};
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

/// An open device without streams yet; closed when it is dropped.
struct Handle<'a> {
    openni: &'a OpenNi,
    raw: sys::OniDeviceHandle,
}

impl Drop for Handle<'_> {
    fn drop(&mut self) {
        // SAFETY: the handle is open, and nothing else has it.
        unsafe { (self.openni.inner.api.device_close)(self.raw) };
    }
}

impl Device {
    /// Opens `target`, sets it up and verifies that it is so; nothing is started.
    pub(crate) fn open(openni: &OpenNi, target: &Target, settings: &Settings) -> Result<Self, OpenniError> {
        let uri = match target {
            Target::First => first(openni)?,
            Target::Uri(uri) => uri.clone(),
            Target::Recording(path) => readable(path)?,
        };
        openni.inner.events.begin(&uri);
        let handle = Handle { openni, raw: open_handle(openni, &uri)? };
        let name = handle.name();
        let (colour, depth) = match target {
            Target::Recording(_) => handle.recorded_streams(&uri)?,
            Target::First | Target::Uri(_) => handle.live_streams(&uri, settings)?,
        };
        let raw = handle.raw;
        std::mem::forget(handle);
        let recording = matches!(target, Target::Recording(_));
        let (openni, synchronised, abandoned) = (openni.clone(), false, false);
        Ok(Self { openni, handle: raw, uri, name, colour, depth, synchronised, recording, abandoned })
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

    /// Asks the camera to take colour and depth at one moment. To be called once, when both streams are started: the library
    /// frees its own memory twice otherwise.
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

    /// The field of view of the colour camera, horizontal and vertical, radians; `None` where it does not tell.
    pub(crate) fn field_of_view(&self) -> Option<(f64, f64)> {
        let stream = Bare { openni: &self.openni, raw: self.colour.handle };
        let angle = |property| {
            let value = f64::from(stream.get(property, 0.0_f32).ok()?);
            (value > 0.0 && value < std::f64::consts::PI).then_some(value)
        };
        Some((angle(sys::STREAM_PROPERTY_HORIZONTAL_FOV)?, angle(sys::STREAM_PROPERTY_VERTICAL_FOV)?))
    }

    /// How many pictures of `sensor` a recording says that it has; 0 where it was not finished.
    pub(crate) fn promised(&self, sensor: Sensor) -> i32 {
        let stream = Bare { openni: &self.openni, raw: self.stream(sensor).handle };
        stream.get(sys::STREAM_PROPERTY_NUMBER_OF_FRAMES, 0).unwrap_or(0).max(0)
    }

    /// The next picture of either stream, as it came; `None` where none comes within `patience`.
    ///
    /// # Errors
    /// Where the library fails, or the picture is not of the stream's mode.
    pub(crate) fn next(&self, patience: Duration) -> Result<Option<Picture>, OpenniError> {
        let api = &self.openni.inner.api;
        let mut streams = [self.depth.handle, self.colour.handle];
        let mut index = -1;
        let milliseconds = c_int::try_from(patience.as_millis()).unwrap_or(c_int::MAX);
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

    /// Gives the device up as it is. Nobody knows what a driver makes of being told to stop a camera that is not there.
    pub(crate) fn abandon(&mut self) {
        self.abandoned = true;
    }

    /// `status` of what was done to the device.
    fn set(&self, what: &'static str, status: sys::OniStatus) -> Result<(), OpenniError> {
        let uri = || self.uri.clone();
        self.openni.inner.check(status).map_err(|error| OpenniError::Setting { uri: uri(), what, error })
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
        // The player of recordings goes through its streams, in a thread of its own and without a lock, until it is closed:
        // they are left to it.
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
        // SAFETY: the library says that so many bytes are there; they stay until the frame is released.
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

fn open_handle(openni: &OpenNi, uri: &str) -> Result<sys::OniDeviceHandle, OpenniError> {
    let failed = |error: String| OpenniError::Open { uri: uri.to_owned(), error };
    let text = CString::new(uri).map_err(|error| failed(error.to_string()))?;
    let mut handle = std::ptr::null_mut();
    // SAFETY: the string has its closing zero and lives through the call, as does the variable.
    let status = unsafe { (openni.inner.api.device_open)(text.as_ptr(), &raw mut handle) };
    openni.inner.check(status).map_err(failed)?;
    Ok(handle)
}

impl Handle<'_> {
    /// What the device is called.
    fn name(&self) -> String {
        let zero = sys::OniDeviceInfo {
            uri: [0; sys::MAX_STR],
            vendor: [0; sys::MAX_STR],
            name: [0; sys::MAX_STR],
            usb_vendor: 0,
            usb_product: 0,
        };
        let mut info = zero;
        // SAFETY: the device is open, and the variable lives through the call.
        unsafe { (self.openni.inner.api.device_info)(self.raw, &raw mut info) };
        format!("{} {}", text(&info.vendor), text(&info.name)).trim().to_owned()
    }

    /// The modes of `sensor`; `None` where the device has none.
    fn modes(&self, sensor: Sensor) -> Option<Vec<Mode>> {
        // SAFETY: the device is open; the library gives null or a description that stays as long as it.
        let info = unsafe { (self.openni.inner.api.sensor_info)(self.raw, sensor.number()) };
        // SAFETY: as above.
        let info = unsafe { info.as_ref() }?;
        let count = usize::try_from(info.mode_count).unwrap_or(0);
        if info.modes.is_null() {
            return Some(Vec::new());
        }
        // SAFETY: the description says that so many modes are there.
        let modes = unsafe { std::slice::from_raw_parts(info.modes, count) };
        Some(modes.iter().filter_map(Mode::from_raw).collect())
    }

    fn create(&self, uri: &str, sensor: Sensor) -> Result<Bare<'_>, OpenniError> {
        let mut raw = std::ptr::null_mut();
        // SAFETY: the device is open, and the variable lives through the call.
        let status =
            unsafe { (self.openni.inner.api.create_stream)(self.raw, sensor.number(), &raw mut raw) };
        let check = self.openni.inner.check(status);
        check.map_err(|error| OpenniError::Open { uri: format!("{uri}, {sensor}"), error })?;
        Ok(Bare { openni: self.openni, raw })
    }

    /// The streams of a camera: size and rate as asked for, depth registered to colour, not mirrored.
    fn live_streams(&self, uri: &str, settings: &Settings) -> Result<(Stream, Stream), OpenniError> {
        let mode = |sensor, formats: &[c_int]| self.find_mode(uri, settings, sensor, formats);
        let colour_mode = mode(Sensor::Colour, &[sys::FORMAT_RGB888])?;
        let depth_mode = mode(Sensor::Depth, &[sys::FORMAT_DEPTH_1_MM, sys::FORMAT_DEPTH_100_UM])?;
        let depth = self.create(uri, Sensor::Depth)?;
        let colour = match self.create(uri, Sensor::Colour) {
            Ok(colour) => colour,
            Err(error) => {
                depth.destroy();
                return Err(error);
            }
        };
        let set = depth
            .set_up(uri, depth_mode)
            .and_then(|()| colour.set_up(uri, colour_mode))
            .and_then(|()| self.register(uri));
        if let Err(error) = set {
            depth.destroy();
            colour.destroy();
            return Err(error);
        }
        Ok((
            Stream { sensor: Sensor::Colour, handle: colour.raw, mode: colour_mode, mirrored: false },
            Stream { sensor: Sensor::Depth, handle: depth.raw, mode: depth_mode, mirrored: false },
        ))
    }

    fn find_mode(
        &self,
        uri: &str,
        settings: &Settings,
        sensor: Sensor,
        formats: &[c_int],
    ) -> Result<Mode, OpenniError> {
        let has = self.modes(sensor).ok_or_else(|| OpenniError::NoSensor { uri: uri.to_owned(), sensor })?;
        let wanted =
            |format| Mode { width: settings.width, height: settings.height, rate: settings.rate, format };
        let found = formats.iter().map(|&format| wanted(format)).find(|mode| has.contains(mode));
        let first = formats.first().copied().unwrap_or_default();
        found.ok_or_else(|| OpenniError::NoMode { uri: uri.to_owned(), sensor, wanted: wanted(first), has })
    }

    /// Has depth given as the colour camera would see it.
    fn register(&self, uri: &str) -> Result<(), OpenniError> {
        let failed = |error: &str| OpenniError::Setting {
            uri: uri.to_owned(),
            what: "registration of depth to colour",
            error: error.to_owned(),
        };
        let (wanted, api) = (sys::REGISTRATION_DEPTH_TO_COLOUR, &self.openni.inner.api);
        // SAFETY: the device is open.
        if unsafe { (api.registration_supported)(self.raw, wanted) } == 0 {
            return Err(failed("this camera cannot do it"));
        }
        self.set(sys::DEVICE_PROPERTY_REGISTRATION, wanted).map_err(|error| failed(&error))?;
        match self.get(sys::DEVICE_PROPERTY_REGISTRATION, 0) {
            Ok(is) if is == wanted => Ok(()),
            Ok(_) => Err(failed("it was accepted, but is not so")),
            Err(error) => Err(failed(&error)),
        }
    }

    /// The streams of a recording, as they were recorded; played frame by frame, once.
    fn recorded_streams(&self, uri: &str) -> Result<(Stream, Stream), OpenniError> {
        let set = |what, result: Result<(), String>| {
            result.map_err(|error| OpenniError::Setting { uri: uri.to_owned(), what, error })
        };
        set("playing once", self.set(sys::DEVICE_PROPERTY_PLAYBACK_REPEAT, 0_i32))?;
        set("playing frame by frame", self.set(sys::DEVICE_PROPERTY_PLAYBACK_SPEED, sys::PLAYBACK_MANUAL))?;
        for sensor in [Sensor::Depth, Sensor::Colour] {
            if self.modes(sensor).is_none() {
                return Err(OpenniError::NoSensor { uri: uri.to_owned(), sensor });
            }
        }
        let depth = self.create(uri, Sensor::Depth)?;
        let colour = match self.create(uri, Sensor::Colour) {
            Ok(colour) => colour,
            Err(error) => {
                depth.destroy();
                return Err(error);
            }
        };
        let streams = colour
            .recorded(uri, Sensor::Colour)
            .and_then(|c| Ok((c, depth.recorded(uri, Sensor::Depth)?)))
            .and_then(|(c, d)| {
                if c.mode.same_size(&d.mode) {
                    return Ok((c, d));
                }
                Err(OpenniError::Sizes { uri: uri.to_owned(), colour: c.mode, depth: d.mode })
            });
        if streams.is_err() {
            depth.destroy();
            colour.destroy();
        }
        streams
    }

    fn set<T: Copy>(&self, property: c_int, value: T) -> Result<(), String> {
        let size = size_of::<T>() as c_int;
        let pointer = std::ptr::from_ref(&value).cast::<c_void>();
        // SAFETY: the device is open; so many bytes of a plain value are at the pointer.
        let status = unsafe { (self.openni.inner.api.device_set)(self.raw, property, pointer, size) };
        self.openni.inner.check(status)
    }

    fn get(&self, property: c_int, zero: c_int) -> Result<c_int, String> {
        let (mut value, mut size) = (zero, size_of::<c_int>() as c_int);
        let pointer = (&raw mut value).cast::<c_void>();
        // SAFETY: the device is open; the library writes no more than `size` bytes, and a C int may have any value.
        let status =
            unsafe { (self.openni.inner.api.device_get)(self.raw, property, pointer, &raw mut size) };
        self.openni.inner.check(status).map(|()| value)
    }
}
