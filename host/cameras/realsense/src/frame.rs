//! Frame in the library's memory.

use std::sync::Arc;

use plumb_timing::{Sensor, Timed};

use crate::error::RealsenseError;
use crate::handle::Owned;
use crate::library::Inner;
use crate::sensor::sensor_of;
use crate::settings::Mode;
use crate::sys::Handle;

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
