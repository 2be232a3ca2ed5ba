//! Pictures, copied out of the library's memory.

use plumb_frame::pairing::{Sensor, Timed};
use plumb_pictures::pair::Pair;

use crate::error::OpenniError;
use crate::settings::Mode;

/// Picture with its pixels row by row, without gaps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Picture {
    pub(crate) sensor: Sensor,
    /// Number of the picture, counted up.
    pub(crate) index: i32,
    /// Time stamp, µs on the device's clock.
    pub(crate) timestamp: u64,
    pub(crate) pixels: Vec<u8>,
}

impl Timed for Picture {
    fn time(&self) -> f64 {
        self.timestamp as f64 * 1e-6
    }
}

/// Joins a colour picture and its depth picture, taken at `time`.
pub(crate) fn pair(time: f64, colour: Picture, depth: &Picture) -> Pair {
    let bytes = depth.pixels.as_chunks::<2>().0;
    let depth = bytes.iter().map(|&bytes| u16::from_ne_bytes(bytes)).collect();
    Pair { time, colour: colour.pixels, depth }
}

/// Picture in the library's memory.
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
    /// Copies the picture row by row without gaps. Exchanges left and right where it is `mirrored`.
    ///
    /// # Errors
    /// Where the picture does not have the mode `expected`.
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

    /// Copies the pixels; `None` where the picture does not have the mode `expected`.
    fn rows(&self, expected: &Mode, mirrored: bool) -> Option<Vec<u8>> {
        let pixel = expected.bytes_per_pixel()?;
        let (width, height) = (usize::from(expected.width), usize::from(expected.height));
        if self.cropped
            || (self.width, self.height) != (expected.width.into(), expected.height.into())
        {
            return None;
        }
        // Recordings have a stride of zero.
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
    use crate::sys;

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
    fn pictures_of_another_mode_are_refused() {
        let bytes = [0; 12];
        assert!(raw(6, &bytes[..11]).unpack(&MODE, false).is_err());
        assert!(raw(4, &bytes).unpack(&MODE, false).is_err());
        assert!(Raw { width: 3, ..raw(6, &bytes) }.unpack(&MODE, false).is_err());
        assert!(Raw { height: 1, ..raw(6, &bytes) }.unpack(&MODE, false).is_err());
        let error = Raw { cropped: true, ..raw(6, &bytes) }.unpack(&MODE, false).unwrap_err();
        assert!(error.to_string().contains("2x2") && error.is_transient(), "{error}");
    }
}
