//! Modes of the streams of a camera.

use core::ffi::c_int;
use std::fmt;

use plumb_timing::Sensor;

use crate::sys;

/// Returns the library's number of `sensor`.
pub(crate) fn sensor_number(sensor: Sensor) -> c_int {
    match sensor {
        Sensor::Colour => sys::SENSOR_COLOUR,
        Sensor::Depth => sys::SENSOR_DEPTH,
    }
}

/// Returns the library's numbers of the supported pixel formats of `sensor`, the preferred one
/// first.
pub(crate) fn formats(sensor: Sensor) -> &'static [c_int] {
    match sensor {
        Sensor::Colour => &[sys::FORMAT_RGB888],
        Sensor::Depth => &[sys::FORMAT_DEPTH_1_MM, sys::FORMAT_DEPTH_100_UM],
    }
}

/// Unit of depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DepthUnit {
    /// A millimetre.
    Millimetre,
    /// A tenth of a millimetre.
    Tenth,
}

impl DepthUnit {
    /// Returns the units in a metre.
    pub fn per_metre(self) -> f64 {
        match self {
            Self::Millimetre => 1_000.0,
            Self::Tenth => 10_000.0,
        }
    }
}

/// Size, rate and format of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mode {
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// Pictures per second.
    pub rate: u16,
    /// The library's number of the pixel format.
    pub format: i32,
}

impl Mode {
    /// Returns the library's form of the mode.
    pub(crate) fn raw(&self) -> sys::OniVideoMode {
        sys::OniVideoMode {
            pixel_format: self.format,
            resolution_x: self.width.into(),
            resolution_y: self.height.into(),
            fps: self.rate.into(),
        }
    }

    /// Converts the library's form; `None` where it has no pixels or a rate out of range.
    pub(crate) fn from_raw(raw: &sys::OniVideoMode) -> Option<Self> {
        let size = |value: i32| u16::try_from(value).ok().filter(|&value| value > 0);
        Some(Self {
            width: size(raw.resolution_x)?,
            height: size(raw.resolution_y)?,
            rate: u16::try_from(raw.fps).ok()?,
            format: raw.pixel_format,
        })
    }

    /// Returns the bytes of a pixel; `None` for an unsupported format.
    pub(crate) fn bytes_per_pixel(&self) -> Option<usize> {
        match self.format {
            sys::FORMAT_RGB888 => Some(3),
            sys::FORMAT_DEPTH_1_MM | sys::FORMAT_DEPTH_100_UM => Some(2),
            _ => None,
        }
    }

    /// Returns whether pictures of `other` have the same number of rows and columns.
    pub fn same_size(&self, other: &Self) -> bool {
        (self.width, self.height) == (other.width, other.height)
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{} at {} Hz", self.width, self.height, self.rate)?;
        match self.format {
            sys::FORMAT_RGB888 | sys::FORMAT_DEPTH_1_MM => Ok(()),
            sys::FORMAT_DEPTH_100_UM => f.write_str(" in 0.1 mm"),
            201 | 205 => f.write_str(" in YUV"),
            202 | 203 => f.write_str(" in grey"),
            204 => f.write_str(" in JPEG"),
            102 | 103 => f.write_str(" in shifts"),
            other => write!(f, " in format {other}"),
        }
    }
}
