//! Open device, and the set-up of its streams.

use core::ffi::{c_int, c_void};
use std::ffi::CString;

use plumb_frame::pairing::Sensor;

use crate::error::OpenniError;
use crate::library::OpenNi;
use crate::settings::{Mode, Settings, formats, sensor_number};
use crate::stream::{RawStream, Stream};
use crate::sys::{self, text};

/// Colour stream and depth stream.
type Streams = (Stream, Stream);

/// Open device without streams. Dropping it closes the device.
pub(crate) struct Handle<'a> {
    openni: &'a OpenNi,
    raw: sys::OniDeviceHandle,
}

impl Drop for Handle<'_> {
    fn drop(&mut self) {
        // SAFETY: the handle is open, and not used after this.
        unsafe { (self.openni.inner.api.device_close)(self.raw) };
    }
}

impl<'a> Handle<'a> {
    /// Opens the device at `uri`.
    pub(crate) fn open(openni: &'a OpenNi, uri: &str) -> Result<Self, OpenniError> {
        let failed = |error: String| OpenniError::Open { uri: uri.to_owned(), error };
        let text = CString::new(uri).map_err(|error| failed(error.to_string()))?;
        let mut raw = std::ptr::null_mut();
        // SAFETY: the string ends with a zero; it and the variable live through the call.
        let status = unsafe { (openni.inner.api.device_open)(text.as_ptr(), &raw mut raw) };
        openni.inner.check(status).map_err(failed)?;
        Ok(Self { openni, raw })
    }

    /// Returns the device's handle, which the caller must close.
    pub(crate) fn into_raw(self) -> sys::OniDeviceHandle {
        let raw = self.raw;
        std::mem::forget(self);
        raw
    }

    /// Returns maker and model of the device.
    pub(crate) fn name(&self) -> String {
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

    /// Returns the modes of `sensor`; `None` where the device lacks the sensor.
    fn modes(&self, sensor: Sensor) -> Option<Vec<Mode>> {
        // SAFETY: the device is open; the library returns null or a description that lives as long
        // as the device.
        let info = unsafe { (self.openni.inner.api.sensor_info)(self.raw, sensor_number(sensor)) };
        // SAFETY: as above.
        let info = unsafe { info.as_ref() }?;
        let count = usize::try_from(info.mode_count).unwrap_or(0);
        if info.modes.is_null() {
            return Some(Vec::new());
        }
        // SAFETY: the description has `mode_count` modes.
        let modes = unsafe { std::slice::from_raw_parts(info.modes, count) };
        Some(modes.iter().filter_map(Mode::from_raw).collect())
    }

    /// Creates the stream of `sensor`.
    fn create(&self, uri: &str, sensor: Sensor) -> Result<RawStream<'_>, OpenniError> {
        let mut raw = std::ptr::null_mut();
        // SAFETY: the device is open, and the variable lives through the call.
        let status = unsafe {
            (self.openni.inner.api.create_stream)(self.raw, sensor_number(sensor), &raw mut raw)
        };
        let check = self.openni.inner.check(status);
        check.map_err(|error| OpenniError::Open { uri: format!("{uri}, {sensor}"), error })?;
        Ok(RawStream { openni: self.openni, raw })
    }

    /// Creates both streams and sets them up with `set_up`. Returns colour and depth. Destroys both
    /// where anything fails.
    fn streams(
        &self,
        uri: &str,
        set_up: impl FnOnce(&RawStream<'_>, &RawStream<'_>) -> Result<Streams, OpenniError>,
    ) -> Result<Streams, OpenniError> {
        let depth = self.create(uri, Sensor::Depth)?;
        let colour = self.create(uri, Sensor::Colour).inspect_err(|_| depth.destroy())?;
        set_up(&colour, &depth).inspect_err(|_| {
            depth.destroy();
            colour.destroy();
        })
    }

    /// Sets up the streams of a camera: size and rate of `settings`, depth registered to colour,
    /// not mirrored. Returns colour and depth.
    pub(crate) fn live_streams(
        &self,
        uri: &str,
        settings: &Settings,
    ) -> Result<Streams, OpenniError> {
        let colour_mode = self.find_mode(uri, settings, Sensor::Colour)?;
        let depth_mode = self.find_mode(uri, settings, Sensor::Depth)?;
        self.streams(uri, |colour, depth| {
            depth.set_up(uri, depth_mode)?;
            colour.set_up(uri, colour_mode)?;
            self.register(uri)?;
            let stream = |sensor, raw: &RawStream<'_>, mode| Stream {
                sensor,
                handle: raw.raw,
                mode,
                mirrored: false,
            };
            let colour = stream(Sensor::Colour, colour, colour_mode);
            Ok((colour, stream(Sensor::Depth, depth, depth_mode)))
        })
    }

    /// Returns the mode of `sensor` that `settings` ask for.
    fn find_mode(
        &self,
        uri: &str,
        settings: &Settings,
        sensor: Sensor,
    ) -> Result<Mode, OpenniError> {
        let formats = formats(sensor);
        let has = self
            .modes(sensor)
            .ok_or_else(|| OpenniError::NoSensor { uri: uri.to_owned(), sensor })?;
        let wanted = |format| Mode {
            width: settings.width,
            height: settings.height,
            rate: settings.rate,
            format,
        };
        let found = formats.iter().map(|&format| wanted(format)).find(|mode| has.contains(mode));
        let first = formats.first().copied().unwrap_or_default();
        found.ok_or_else(|| OpenniError::NoMode {
            uri: uri.to_owned(),
            sensor,
            wanted: wanted(first),
            has,
        })
    }

    /// Turns on the registration of depth to colour, and verifies it.
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

    /// Sets up the streams of a recording, to be played once and frame by frame. Returns colour and
    /// depth.
    pub(crate) fn recorded_streams(&self, uri: &str) -> Result<Streams, OpenniError> {
        let set = |what, result: Result<(), String>| {
            result.map_err(|error| OpenniError::Setting { uri: uri.to_owned(), what, error })
        };
        set("playing once", self.set(sys::DEVICE_PROPERTY_PLAYBACK_REPEAT, 0_i32))?;
        set(
            "playing frame by frame",
            self.set(sys::DEVICE_PROPERTY_PLAYBACK_SPEED, sys::PLAYBACK_MANUAL),
        )?;
        for sensor in [Sensor::Depth, Sensor::Colour] {
            if self.modes(sensor).is_none() {
                return Err(OpenniError::NoSensor { uri: uri.to_owned(), sensor });
            }
        }
        self.streams(uri, |colour, depth| {
            let colour = colour.recorded(uri, Sensor::Colour)?;
            let depth = depth.recorded(uri, Sensor::Depth)?;
            if !colour.mode.same_size(&depth.mode) {
                return Err(OpenniError::Sizes {
                    uri: uri.to_owned(),
                    colour: colour.mode,
                    depth: depth.mode,
                });
            }
            Ok((colour, depth))
        })
    }

    fn set<T: Copy>(&self, property: c_int, value: T) -> Result<(), String> {
        let size = size_of::<T>() as c_int;
        let pointer = std::ptr::from_ref(&value).cast::<c_void>();
        // SAFETY: the device is open; the pointer is to `size` bytes of a plain value.
        let status =
            unsafe { (self.openni.inner.api.device_set)(self.raw, property, pointer, size) };
        self.openni.inner.check(status)
    }

    fn get(&self, property: c_int, zero: c_int) -> Result<c_int, String> {
        let (mut value, mut size) = (zero, size_of::<c_int>() as c_int);
        let pointer = (&raw mut value).cast::<c_void>();
        // SAFETY: the device is open; the library writes at most `size` bytes, and any bytes make a
        // C int.
        let status = unsafe {
            (self.openni.inner.api.device_get)(self.raw, property, pointer, &raw mut size)
        };
        self.openni.inner.check(status).map(|()| value)
    }
}
