//! Options of a sensor: exposure, projector, unit of depth.

use crate::error::RealsenseError;
use crate::handle::Owned;
use crate::library::Inner;
use crate::settings::Settings;
use crate::sys;

/// Unit of a sensor's exposure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ExposureUnit {
    /// Of a colour sensor.
    TenthMillisecond,
    /// Of a depth sensor.
    Microsecond,
}

impl ExposureUnit {
    /// Returns the exposure in this unit.
    fn of(self, seconds: f64) -> f32 {
        let units = match self {
            Self::TenthMillisecond => seconds * 1e4,
            Self::Microsecond => seconds * 1e6,
        };
        units as f32
    }

    /// Returns the name of the option for messages.
    fn exposure(self) -> &'static str {
        match self {
            Self::TenthMillisecond => "the exposure, in units of 0.1 ms",
            Self::Microsecond => "the exposure, in microseconds",
        }
    }
}

/// Largest difference between an option and its value read back, as a part of the value: the
/// library's numbers have 24 bits, and a sensor rounds to its step.
const TOLERANCE: f32 = 0.02;

/// Options of one sensor.
pub(crate) struct Options<'a> {
    pub(crate) inner: &'a Inner,
    pub(crate) sensor: &'a Owned,
    /// Name of the camera for messages.
    pub(crate) id: &'a str,
}

impl Options<'_> {
    /// Sets the exposure of the sensor of colour, and verifies it. The rate stays as set, also in
    /// the dark.
    pub(crate) fn set_exposure(
        &self,
        settings: &Settings,
        unit: ExposureUnit,
    ) -> Result<(), RealsenseError> {
        if self.has(sys::OPTION_AUTO_EXPOSURE_PRIORITY) {
            self.set(sys::OPTION_AUTO_EXPOSURE_PRIORITY, 0.0, "a constant frame rate")?;
        }
        let automatic = settings.exposure.is_none();
        if self.has(sys::OPTION_AUTO_EXPOSURE) {
            let value = if automatic { 1.0 } else { 0.0 };
            self.set(sys::OPTION_AUTO_EXPOSURE, value, "automatic exposure")?;
        }
        match settings.exposure {
            Some(seconds) => self.set(sys::OPTION_EXPOSURE, unit.of(seconds), unit.exposure()),
            None => Ok(()),
        }
    }

    /// Switches the projector of a depth sensor, and verifies it.
    pub(crate) fn set_emitter(&self, on: bool) -> Result<(), RealsenseError> {
        let value = if on { 1.0 } else { 0.0 };
        self.set(sys::OPTION_EMITTER, value, "the infrared projector")
    }

    /// Returns the length of a unit of depth, metres, above 0.
    pub(crate) fn depth_unit(&self) -> Result<f64, RealsenseError> {
        let unit = self.get(sys::OPTION_DEPTH_UNITS);
        let unit = f64::from(unit.map_err(|error| self.failed("the unit of depth", error))?);
        // Written in decimal by the maker, read back as a number of 24 bits.
        let unit = (unit * 1e9).round() / 1e9;
        if (1e-6..=0.01).contains(&unit) {
            return Ok(unit);
        }
        Err(RealsenseError::DepthUnit { id: self.id.to_owned(), unit })
    }

    fn failed(&self, what: &'static str, error: String) -> RealsenseError {
        RealsenseError::Setting { id: self.id.to_owned(), what, error }
    }

    fn has(&self, option: i32) -> bool {
        let api = &self.inner.api;
        // SAFETY: the sensor lives.
        let call = |error| unsafe { (api.supports_option)(self.sensor.raw(), option, error) };
        api.check(call).is_ok_and(|answer| answer != 0)
    }

    fn get(&self, option: i32) -> Result<f32, String> {
        let api = &self.inner.api;
        // SAFETY: the sensor lives.
        api.check(|error| unsafe { (api.get_option)(self.sensor.raw(), option, error) })
    }

    /// Sets an option and verifies it.
    fn set(&self, option: i32, value: f32, what: &'static str) -> Result<(), RealsenseError> {
        if !self.has(option) {
            return Err(self.failed(what, "this camera cannot set it".to_owned()));
        }
        let (least, most) = self.range(option).map_err(|error| self.failed(what, error))?;
        if !(least..=most).contains(&value) {
            let error = format!("{value} is not between {least} and {most}");
            return Err(self.failed(what, error));
        }
        let api = &self.inner.api;
        // SAFETY: the sensor lives.
        let set = |error| unsafe { (api.set_option)(self.sensor.raw(), option, value, error) };
        api.check(set).map_err(|error| self.failed(what, error))?;
        match self.get(option) {
            Ok(is) if (is - value).abs() <= TOLERANCE * value.abs() => Ok(()),
            Ok(is) => Err(self.failed(what, format!("{value} was accepted, but it is {is}"))),
            Err(error) => Err(self.failed(what, error)),
        }
    }

    /// Returns the least and the largest value of an option.
    fn range(&self, option: i32) -> Result<(f32, f32), String> {
        let (mut least, mut most, mut step, mut default) = (0.0, 0.0, 0.0, 0.0);
        let (api, raw) = (&self.inner.api, self.sensor.raw());
        // SAFETY: the sensor lives, and the variables live through the call.
        api.check(|error| unsafe {
            (api.option_range)(
                raw,
                option,
                &raw mut least,
                &raw mut most,
                &raw mut step,
                &raw mut default,
                error,
            )
        })?;
        Ok((least, most))
    }
}
