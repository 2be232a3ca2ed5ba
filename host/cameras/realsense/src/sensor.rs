//! Streams of a device's sensors, and their frames in the library's memory.

use core::ffi::c_int;
use std::sync::Arc;

use plumb_frame::pairing::{Sensor, Timed};

use crate::error::RealsenseError;
use crate::handle::Owned;
use crate::library::Inner;
use crate::options::ExposureUnit;
use crate::settings::Mode;
use crate::sys::{self, Handle, RawIntrinsics};

/// Stream that a sensor offers.
#[derive(Debug, Clone, Copy)]
struct Profile {
    /// Handle, which lives as long as its sensor's list of profiles.
    raw: Handle,
    mode: Mode,
}

/// Sensor with the stream of it that is read.
pub(crate) struct Stream {
    /// Number of the sensor in its device.
    number: usize,
    handle: Owned,
    /// Profiles of the sensor. The chosen one points into them.
    _profiles: Owned,
    profile: Profile,
}

impl Stream {
    /// Finds the stream of `sensor` in `device`: that of the mode `wanted`, or the first one of a
    /// recording. The sensor with the number `last` is the last that is looked at.
    fn find(
        inner: &Inner,
        (device, id): (&Owned, &str),
        sensor: Sensor,
        wanted: Option<Mode>,
        last: Option<usize>,
    ) -> Result<Self, RealsenseError> {
        let failed = |error| RealsenseError::Open { id: id.to_owned(), error };
        let (mut found, mut has) = (false, Vec::new());
        let sensors = sensors(inner, device).map_err(failed)?;
        let mut sensors: Vec<(usize, Owned)> = sensors.into_iter().enumerate().collect();
        sensors.sort_by_key(|(number, _)| Some(*number) == last);
        for (number, handle) in sensors {
            let (list, profiles) = profiles(inner, &handle, sensor).map_err(failed)?;
            found |= !profiles.is_empty();
            has.extend(profiles.iter().map(|profile| profile.mode));
            let fits = |profile: &&Profile| wanted.is_none_or(|mode| profile.mode == mode);
            if let Some(&profile) = profiles.iter().find(fits) {
                return Ok(Self { number, handle, _profiles: list, profile });
            }
        }
        has.sort();
        has.dedup();
        Err(match wanted {
            Some(wanted) if found => {
                RealsenseError::NoMode { id: id.to_owned(), sensor, wanted, has }
            }
            _ => RealsenseError::NoSensor { id: id.to_owned(), sensor, format: format(sensor).1 },
        })
    }

    /// Returns size and rate of the stream.
    pub(crate) fn mode(&self) -> Mode {
        self.profile.mode
    }

    /// Returns the sensor's handle, for its options.
    pub(crate) fn handle(&self) -> &Owned {
        &self.handle
    }

    /// Returns the intrinsics of the stream.
    pub(crate) fn intrinsics(&self, inner: &Inner) -> Result<RawIntrinsics, String> {
        let (api, mut raw) = (&inner.api, RawIntrinsics::default());
        // SAFETY: the profile lives as long as its list.
        let get =
            |error| unsafe { (api.profile_intrinsics)(self.profile.raw, &raw mut raw, error) };
        api.check(get).map(|()| raw)
    }
}

/// Streams of colour and depth. They are stopped and closed when they are dropped.
pub(crate) struct Streams {
    inner: Arc<Inner>,
    pub(crate) colour: Stream,
    pub(crate) depth: Stream,
    /// Sensors that are open. The handles are those of `colour` and `depth`.
    open: Vec<Handle>,
    /// Those of them that are started.
    started: Vec<Handle>,
}

// SAFETY: the handles are those of librealsense2, which may be used in any thread. The profiles and
// the handles of open sensors live as long as `colour` and `depth`.
unsafe impl Send for Streams {}

impl Streams {
    /// Finds the streams of the mode `wanted` in the device `id`, or the first ones of a recording.
    pub(crate) fn find(
        inner: &Arc<Inner>,
        device: &Owned,
        id: &str,
        wanted: Option<Mode>,
    ) -> Result<Self, RealsenseError> {
        let find = |sensor, last| Stream::find(inner, (device, id), sensor, wanted, last);
        let depth = find(Sensor::Depth, None)?;
        // A D405 has colour from its depth sensor only. Others may have it there too, through a
        // lens that lets infrared light in.
        let colour = find(Sensor::Colour, Some(depth.number))?;
        let inner = Arc::clone(inner);
        Ok(Self { inner, colour, depth, open: Vec::new(), started: Vec::new() })
    }

    /// Returns whether one sensor delivers both streams.
    fn are_of_one_sensor(&self) -> bool {
        self.colour.number == self.depth.number
    }

    /// Returns the unit of the exposure of colour.
    pub(crate) fn exposure_unit(&self) -> ExposureUnit {
        if self.are_of_one_sensor() {
            ExposureUnit::Microsecond
        } else {
            ExposureUnit::TenthMillisecond
        }
    }

    /// Opens and starts the sensors. Their frames go to `queue`, which must outlive the streams.
    pub(crate) fn start(&mut self, queue: &Owned) -> Result<(), String> {
        let [depth, colour] = [&self.depth, &self.colour].map(|stream| stream.profile.raw);
        let [depth_sensor, colour_sensor] =
            [&self.depth, &self.colour].map(|stream| stream.handle.raw());
        if self.are_of_one_sensor() {
            return self.start_sensor(depth_sensor, &mut [depth, colour], queue);
        }
        self.start_sensor(depth_sensor, &mut [depth], queue)?;
        self.start_sensor(colour_sensor, &mut [colour], queue)
    }

    /// Opens and starts a sensor with these profiles.
    fn start_sensor(
        &mut self,
        sensor: Handle,
        profiles: &mut [Handle],
        queue: &Owned,
    ) -> Result<(), String> {
        let (api, count) = (&self.inner.api, profiles.len() as c_int);
        // SAFETY: the sensor and its profiles live.
        api.check(|error| unsafe { (api.open)(sensor, profiles.as_mut_ptr(), count, error) })?;
        self.open.push(sensor);
        // SAFETY: the sensor and the queue live.
        api.check(|error| unsafe { (api.start_queue)(sensor, queue.raw(), error) })?;
        self.started.push(sensor);
        Ok(())
    }
}

impl Drop for Streams {
    fn drop(&mut self) {
        let api = &self.inner.api;
        // There is no one to report the errors of an unplugged camera to.
        for &sensor in &self.started {
            // SAFETY: the sensor lives.
            let _ = api.check(|error| unsafe { (api.stop)(sensor, error) });
        }
        for &sensor in &self.open {
            // SAFETY: the sensor lives.
            let _ = api.check(|error| unsafe { (api.close)(sensor, error) });
        }
    }
}

/// Returns the library's numbers of a sensor's stream, and its format with its name.
fn format(sensor: Sensor) -> ((c_int, c_int), &'static str) {
    match sensor {
        Sensor::Colour => ((sys::STREAM_COLOUR, sys::FORMAT_RGB8), "RGB8"),
        Sensor::Depth => ((sys::STREAM_DEPTH, sys::FORMAT_Z16), "Z16"),
    }
}

/// Returns handles of the device's sensors.
fn sensors(inner: &Inner, device: &Owned) -> Result<Vec<Owned>, String> {
    let api = &inner.api;
    // SAFETY: the device lives.
    let list = api.check(|error| unsafe { (api.query_sensors)(device.raw(), error) })?;
    let list = Owned::new(list, api.delete_sensor_list)?;
    // SAFETY: the list lives.
    let count = api.check(|error| unsafe { (api.sensor_count)(list.raw(), error) })?;
    (0..count)
        .map(|index| {
            // SAFETY: the list lives, and has more than `index` sensors.
            let create = |error| unsafe { (api.create_sensor)(list.raw(), index, error) };
            Owned::new(api.check(create)?, api.delete_sensor)
        })
        .collect()
}

/// Returns the profiles of `handle` that are streams of `sensor` in the supported format, and the
/// list that they live in.
fn profiles(
    inner: &Inner,
    handle: &Owned,
    sensor: Sensor,
) -> Result<(Owned, Vec<Profile>), String> {
    let api = &inner.api;
    // SAFETY: the sensor lives.
    let list = api.check(|error| unsafe { (api.profiles)(handle.raw(), error) })?;
    let list = Owned::new(list, api.delete_profiles)?;
    // SAFETY: the list lives.
    let count = api.check(|error| unsafe { (api.profile_count)(list.raw(), error) })?;
    let mut found = Vec::new();
    for index in 0..count {
        // SAFETY: the list lives, and has more than `index` profiles.
        let raw = api.check(|error| unsafe { (api.profile_at)(list.raw(), index, error) })?;
        found.extend(read_profile(inner, raw, sensor)?);
    }
    Ok((list, found))
}

/// Reads a profile; `None` where it is not a stream of `sensor` in the supported format.
fn read_profile(inner: &Inner, raw: Handle, sensor: Sensor) -> Result<Option<Profile>, String> {
    let api = &inner.api;
    let (mut stream, mut format_number, mut rate) = (0, 0, 0);
    let (mut index, mut id) = (0, 0);
    // SAFETY: the profile lives as long as its list; the variables live through the call.
    api.check(|error| unsafe {
        (api.profile_data)(
            raw,
            &raw mut stream,
            &raw mut format_number,
            &raw mut index,
            &raw mut id,
            &raw mut rate,
            error,
        )
    })?;
    if (stream, format_number) != format(sensor).0 {
        return Ok(None);
    }
    let (mut width, mut height) = (0, 0);
    // SAFETY: as above; the profile is one of pictures.
    api.check(|error| unsafe { (api.profile_size)(raw, &raw mut width, &raw mut height, error) })?;
    let number = |value: c_int| u16::try_from(value).ok().filter(|&value| value > 0);
    let mode = number(width).zip(number(height)).zip(number(rate));
    Ok(mode.map(|((width, height), rate)| Profile { raw, mode: Mode { width, height, rate } }))
}

/// Returns the sensor that a frame's profile belongs to; `None` for another stream.
pub(crate) fn sensor_of(inner: &Inner, profile: Handle) -> Result<Option<Sensor>, String> {
    for sensor in [Sensor::Colour, Sensor::Depth] {
        if read_profile(inner, profile, sensor)?.is_some() {
            return Ok(Some(sensor));
        }
    }
    Ok(None)
}

/// Frame of a sensor. It is given back to the library when it is dropped.
pub(crate) struct Frame {
    inner: Arc<Inner>,
    handle: Owned,
    pub(crate) sensor: Sensor,
    /// Time stamp, seconds on the clock `domain`.
    time: f64,
    /// Number of the clock that stamps the frame.
    pub(crate) domain: i32,
}

impl Timed for Frame {
    fn time(&self) -> f64 {
        self.time
    }
}

impl Frame {
    /// Takes over the frame `raw`; `None` for a frame of another stream.
    pub(crate) fn new(inner: &Arc<Inner>, raw: Handle) -> Result<Option<Self>, String> {
        let (api, inner) = (&inner.api, Arc::clone(inner));
        let handle = Owned::new(raw, api.release_frame)?;
        // SAFETY: the frame lives until it is dropped.
        let profile = api.check(|error| unsafe { (api.frame_profile)(raw, error) })?;
        let Some(sensor) = sensor_of(&inner, profile)? else { return Ok(None) };
        // SAFETY: as above.
        let time = api.check(|error| unsafe { (api.frame_time)(raw, error) })? * 1e-3;
        // SAFETY: as above.
        let domain = api.check(|error| unsafe { (api.frame_domain)(raw, error) })?;
        Ok(Some(Self { inner, handle, sensor, time, domain }))
    }

    /// Returns the handle and gives up its ownership.
    pub(crate) fn into_raw(self) -> Handle {
        self.handle.into_raw()
    }

    /// Returns the length of a unit of depth, metres.
    pub(crate) fn depth_unit(&self) -> Result<f64, String> {
        let (api, raw) = (&self.inner.api, self.handle.raw());
        // SAFETY: the frame lives, and is one of depth.
        api.check(|error| unsafe { (api.depth_units)(raw, error) }).map(f64::from)
    }

    /// Copies the pixels, of `pixel` bytes each, row by row without gaps.
    ///
    /// # Errors
    /// Where the frame does not have the size `expected`.
    pub(crate) fn pixels(&self, expected: Mode, pixel: usize) -> Result<Vec<u8>, RealsenseError> {
        let api = &self.inner.api;
        let number = |call: unsafe extern "C" fn(Handle, crate::sys::ErrorOut) -> i32| {
            // SAFETY: the frame lives, and is a picture.
            api.check(|error| unsafe { call(self.handle.raw(), error) }).unwrap_or(0)
        };
        let (width, height) = (number(api.frame_width), number(api.frame_height));
        let refused = RealsenseError::Picture { sensor: self.sensor, width, height, expected };
        if (width, height) != (expected.width.into(), expected.height.into()) {
            return Err(refused);
        }
        let row = usize::from(expected.width) * pixel;
        let stride = usize::try_from(number(api.frame_stride)).unwrap_or(0);
        if stride < row {
            return Err(refused);
        }
        // SAFETY: the frame lives.
        let data = api.check(|error| unsafe { (api.frame_data)(self.handle.raw(), error) });
        let Some(data) = data.ok().filter(|data| !data.is_null()) else { return Err(refused) };
        let rows = usize::from(expected.height);
        // SAFETY: the frame has this number of rows, `stride` bytes apart, and lives through the
        // copy. The library's own size of the data is 0 for frames of a software device.
        let data = unsafe { std::slice::from_raw_parts(data.cast::<u8>(), stride * rows) };
        Ok(data.chunks(stride).flat_map(|line| &line[..row]).copied().collect())
    }
}
