//! Pictures, and how they are out of the library's memory.

use core::ffi::c_int;
use std::fmt;

use crate::OpenniError;
use crate::sys;

/// Which of a camera's sensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensor {
    /// Red, green and blue.
    Colour,
    /// Distances.
    Depth,
}

impl Sensor {
    /// The other one of a pair.
    pub fn other(self) -> Self {
        match self {
            Self::Colour => Self::Depth,
            Self::Depth => Self::Colour,
        }
    }

    /// Its number in the library.
    pub(crate) fn number(self) -> i32 {
        match self {
            Self::Colour => sys::SENSOR_COLOUR,
            Self::Depth => sys::SENSOR_DEPTH,
        }
    }

    /// The library's numbers of the formats that are understood, the one that is liked best first.
    pub(crate) fn formats(self) -> &'static [c_int] {
        match self {
            Self::Colour => &[sys::FORMAT_RGB888],
            Self::Depth => &[sys::FORMAT_DEPTH_1_MM, sys::FORMAT_DEPTH_100_UM],
        }
    }
}

impl fmt::Display for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Colour => "colour",
            Self::Depth => "depth",
        })
    }
}

/// What a unit of depth is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DepthUnit {
    /// A millimetre.
    Millimetre,
    /// A tenth of a millimetre.
    Tenth,
}

impl DepthUnit {
    /// Units in a metre.
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
    /// Pictures a second.
    pub rate: u16,
    /// The library's number of the pixels' format.
    pub format: i32,
}

impl Mode {
    /// The mode as the library has it.
    pub(crate) fn raw(&self) -> sys::OniVideoMode {
        sys::OniVideoMode {
            pixel_format: self.format,
            resolution_x: self.width.into(),
            resolution_y: self.height.into(),
            fps: self.rate.into(),
        }
    }

    /// `None` for what is no picture's mode.
    pub(crate) fn from_raw(raw: &sys::OniVideoMode) -> Option<Self> {
        let size = |value: i32| u16::try_from(value).ok().filter(|&value| value > 0);
        Some(Self {
            width: size(raw.resolution_x)?,
            height: size(raw.resolution_y)?,
            rate: u16::try_from(raw.fps).ok()?,
            format: raw.pixel_format,
        })
    }

    /// Bytes of a pixel, in the formats that are read here.
    fn bytes_per_pixel(&self) -> Option<usize> {
        match self.format {
            sys::FORMAT_RGB888 => Some(3),
            sys::FORMAT_DEPTH_1_MM | sys::FORMAT_DEPTH_100_UM => Some(2),
            _ => None,
        }
    }

    /// Whether pictures of `other` have the same number of rows and columns.
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

/// A colour picture and its depth.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// When they were taken, seconds: on the host's clock since the camera was opened, or on the
    /// recording's.
    pub time: f64,
    /// Red, green, blue, row by row from the top left.
    pub colour: Vec<u8>,
    /// Depths, row by row from the top left, in the [`DepthUnit`] that the camera was opened with;
    /// 0 = none.
    pub depth: Vec<u16>,
}

/// A picture, its pixels packed row by row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Picture {
    pub(crate) sensor: Sensor,
    /// Counts up.
    pub(crate) index: i32,
    /// µs on the device's clock.
    pub(crate) timestamp: u64,
    pub(crate) pixels: Vec<u8>,
}

/// A picture as the library says it is, its bytes beside it.
pub(crate) struct Raw<'a> {
    pub(crate) sensor: Sensor,
    pub(crate) index: i32,
    pub(crate) timestamp: u64,
    pub(crate) width: i32,
    pub(crate) height: i32,
    pub(crate) stride: i32,
    pub(crate) cropped: bool,
    pub(crate) bytes: &'a [u8],
}

impl Raw<'_> {
    /// The picture, packed, and with left and right exchanged where it came `mirrored`.
    ///
    /// # Errors
    /// Where it is not of the mode `expected`.
    pub(crate) fn unpack(&self, expected: &Mode, mirrored: bool) -> Result<Picture, OpenniError> {
        self.rows(expected, mirrored)
            .map(|pixels| Picture {
                sensor: self.sensor,
                index: self.index,
                timestamp: self.timestamp,
                pixels,
            })
            .ok_or_else(|| OpenniError::Picture {
                sensor: self.sensor,
                width: self.width,
                height: self.height,
                bytes: i32::try_from(self.bytes.len()).unwrap_or(i32::MAX),
                expected: *expected,
            })
    }

    fn rows(&self, expected: &Mode, mirrored: bool) -> Option<Vec<u8>> {
        let pixel = expected.bytes_per_pixel()?;
        let (width, height) = (usize::from(expected.width), usize::from(expected.height));
        if self.cropped
            || (self.width, self.height) != (expected.width.into(), expected.height.into())
        {
            return None;
        }
        // Players of recordings leave the stride zero.
        let stride = usize::try_from(self.stride).ok().filter(|&s| s > 0).unwrap_or(width * pixel);
        if stride < width * pixel || self.bytes.len() < stride * (height - 1) + width * pixel {
            return None;
        }
        let mut pixels = Vec::with_capacity(width * height * pixel);
        for row in self.bytes.chunks(stride).take(height) {
            let row = &row[..width * pixel];
            if mirrored {
                pixels.extend(row.rchunks_exact(pixel).flatten());
            } else {
                pixels.extend_from_slice(row);
            }
        }
        Some(pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODE: Mode = Mode { width: 2, height: 2, rate: 30, format: sys::FORMAT_RGB888 };

    fn raw(stride: i32, bytes: &[u8]) -> Raw<'_> {
        Raw {
            sensor: Sensor::Colour,
            index: 1,
            timestamp: 5,
            width: 2,
            height: 2,
            stride,
            cropped: false,
            bytes,
        }
    }

    #[test]
    fn rows_are_packed_and_unmirrored() {
        let bytes: Vec<u8> = (0..16).collect();
        let picture = raw(8, &bytes).unpack(&MODE, false).unwrap();
        assert_eq!(picture.pixels, [0, 1, 2, 3, 4, 5, 8, 9, 10, 11, 12, 13]);
        let picture = raw(8, &bytes).unpack(&MODE, true).unwrap();
        assert_eq!(picture.pixels, [3, 4, 5, 0, 1, 2, 11, 12, 13, 8, 9, 10]);
        let packed = raw(0, &bytes[..12]).unpack(&MODE, false).unwrap();
        assert_eq!(packed.pixels, bytes[..12]);
    }

    #[test]
    fn what_is_not_of_the_mode_is_refused() {
        let bytes = [0; 12];
        assert!(raw(6, &bytes[..11]).unpack(&MODE, false).is_err());
        assert!(raw(4, &bytes).unpack(&MODE, false).is_err());
        assert!(Raw { width: 3, ..raw(6, &bytes) }.unpack(&MODE, false).is_err());
        assert!(Raw { height: 1, ..raw(6, &bytes) }.unpack(&MODE, false).is_err());
        let error = Raw { cropped: true, ..raw(6, &bytes) }.unpack(&MODE, false).unwrap_err();
        assert!(error.to_string().contains("2x2") && error.is_passing(), "{error}");
    }
}
