//! Pictures from messages.

use plumb_frame::image::{ColourImage, DepthImage, Image as Pixels, ImageSize};
use plumb_pictures::{decode, raw};

use super::error::Ros2CameraError;
use crate::message::sensor::{CompressedImage, Image};

/// Units of depth in a metre: the encoding `16UC1` has millimetres (REP 118).
pub(crate) const DEPTH_SCALE: f64 = 1000.0;

/// Encodings of colour pictures.
const COLOURS: &str = "`rgb8`, `bgr8`, `rgba8`, `bgra8`, `yuv422` or `yuv422_yuy2`";

/// Encodings of depth pictures.
const DEPTHS: &str = "`16UC1` (millimetres) or `32FC1` (metres)";

/// Most columns or rows of a picture.
pub(crate) const MAX_SIDE: u32 = 8192;

/// Colour picture as it comes.
#[derive(Debug)]
pub(crate) enum Colour {
    /// Of a topic of `sensor_msgs/Image`.
    Raw(Image),
    /// Of a topic of `sensor_msgs/CompressedImage`.
    Compressed(CompressedImage),
}

impl Colour {
    /// Returns the name of the coordinate frame.
    pub(crate) fn frame(&self) -> &str {
        match self {
            Self::Raw(image) => &image.header.frame_id,
            Self::Compressed(file) => &file.header.frame_id,
        }
    }

    /// Decodes the picture, which came on `topic`.
    ///
    /// # Errors
    /// Where its encoding, its size or its bytes are wrong.
    pub(crate) fn decode(&self, topic: &str) -> Result<ColourImage, Ros2CameraError> {
        let raw = match self {
            Self::Raw(raw) => raw,
            Self::Compressed(file) if file.format.starts_with("mono") => {
                return Err(grey(topic, &file.format));
            }
            Self::Compressed(file) => {
                let failure = |error| Ros2CameraError::Decode { topic: topic.to_owned(), error };
                return decode::colour(&file.data).map_err(failure);
            }
        };
        let pixels = match raw.encoding.as_str() {
            "rgb8" => raw::bgr_of_rgb(&packed(raw, 3, topic)?),
            "bgr8" => packed(raw, 3, topic)?.as_chunks().0.to_vec(),
            "rgba8" => raw::bgr_of_rgba(&packed(raw, 4, topic)?),
            "bgra8" => raw::bgr_of_bgra(&packed(raw, 4, topic)?),
            "yuv422" | "uyvy" => raw::bgr_of_uyvy(&packed(raw, 2, topic)?),
            "yuv422_yuy2" | "yuyv" => raw::bgr_of_yuyv(&packed(raw, 2, topic)?),
            "mono8" | "mono16" => return Err(grey(topic, &raw.encoding)),
            _ => return Err(encoding(raw, topic, COLOURS)),
        };
        let ImageSize { width, height } = size(raw);
        Ok(Pixels::new(width, height, pixels)?)
    }
}

/// Decodes a depth picture, which came on `topic`, to millimetres. 0 and 65535 are unknown depths,
/// and so are metres that are no number, not above 0, or beyond 65.534.
///
/// # Errors
/// As [`Colour::decode`].
pub(crate) fn depth(raw: &Image, topic: &str) -> Result<DepthImage, Ros2CameraError> {
    let is_little = raw.is_bigendian == 0;
    let pixels = match raw.encoding.as_str() {
        "16UC1" | "mono16" => raw::depth_of_millimetres(&packed(raw, 2, topic)?, is_little),
        "32FC1" => raw::depth_of_metres(&packed(raw, 4, topic)?, is_little),
        _ => return Err(encoding(raw, topic, DEPTHS)),
    };
    let ImageSize { width, height } = size(raw);
    Ok(Pixels::new(width, height, pixels)?)
}

fn size(raw: &Image) -> ImageSize {
    ImageSize { width: raw.width as usize, height: raw.height as usize }
}

fn grey(topic: &str, found: &str) -> Ros2CameraError {
    Ros2CameraError::Grey { topic: topic.to_owned(), found: found.to_owned() }
}

fn encoding(raw: &Image, topic: &str, expected: &'static str) -> Ros2CameraError {
    Ros2CameraError::Encoding { topic: topic.to_owned(), found: raw.encoding.clone(), expected }
}

/// Returns the bytes of the pixels, `per_pixel` each, without the bytes that fill the rows.
fn packed(raw: &Image, per_pixel: usize, topic: &str) -> Result<Vec<u8>, Ros2CameraError> {
    let row = raw.width as usize * per_pixel;
    let (step, rows) = (raw.step as usize, raw.height as usize);
    let is_possible = raw.width.max(raw.height) <= MAX_SIDE && row > 0;
    if !is_possible || step < row || raw.data.len() != step * rows {
        let (topic, bytes) = (topic.to_owned(), raw.data.len());
        return Err(Ros2CameraError::Layout { topic, size: size(raw), step: raw.step, bytes });
    }
    if step == row {
        return Ok(raw.data.clone());
    }
    Ok(raw.data.chunks_exact(step).flat_map(|bytes| &bytes[..row]).copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{Header, Time};

    fn image(encoding: &str, step: u32, data: &[u8]) -> Image {
        let header = Header { stamp: Time::from_nanoseconds(0), frame_id: String::new() };
        let (encoding, data) = (encoding.to_owned(), data.to_vec());
        Image { header, height: 2, width: 1, encoding, is_bigendian: 0, step, data }
    }

    fn colour(encoding: &str, step: u32, data: &[u8]) -> Result<ColourImage, String> {
        let picture = Colour::Raw(image(encoding, step, data)).decode("/colour");
        picture.map_err(|error| error.to_string())
    }

    #[test]
    fn both_orders_of_colours_and_filled_rows_are_read() {
        let expected = [[1, 2, 3], [4, 5, 6]];
        assert_eq!(colour("bgr8", 3, &[1, 2, 3, 4, 5, 6]).unwrap().pixels(), expected);
        assert_eq!(colour("rgb8", 3, &[3, 2, 1, 6, 5, 4]).unwrap().pixels(), expected);
        assert_eq!(colour("bgr8", 4, &[1, 2, 3, 0, 4, 5, 6, 0]).unwrap().pixels(), expected);
    }

    #[test]
    fn depth_is_read_in_either_byte_order() {
        let little = image("16UC1", 2, &[0x34, 0x12, 0, 0]);
        assert_eq!(depth(&little, "/depth").unwrap().pixels(), [0x1234, 0]);
        let big = Image { is_bigendian: 1, ..image("16UC1", 2, &[0x12, 0x34, 0, 0]) };
        assert_eq!(depth(&big, "/depth").unwrap().pixels(), [0x1234, 0]);
    }

    #[test]
    fn the_encodings_of_the_field_are_read() {
        let expected = [[1, 2, 3], [4, 5, 6]];
        assert_eq!(colour("bgra8", 4, &[1, 2, 3, 9, 4, 5, 6, 9]).unwrap().pixels(), expected);
        assert_eq!(colour("rgba8", 4, &[3, 2, 1, 9, 6, 5, 4, 9]).unwrap().pixels(), expected);
        let grey = colour("mono8", 1, &[1, 2]).unwrap_err();
        assert!(grey.contains("/colour") && grey.contains("grey (`mono8`)"), "{grey}");
        let metres = [1.2345_f32, f32::NAN].map(f32::to_le_bytes).concat();
        assert_eq!(depth(&image("32FC1", 4, &metres), "/depth").unwrap().pixels(), [1235, 0]);
        let unknown = image("16UC1", 2, &[0xff, 0xff, 0xfe, 0xff]);
        assert_eq!(depth(&unknown, "/depth").unwrap().pixels(), [0, 0xfffe]);
    }

    #[test]
    fn other_encodings_and_sizes_are_refused_with_the_topic() {
        let error = colour("bayer_rggb8", 1, &[0; 2]).unwrap_err();
        assert!(error.contains("/colour") && error.contains("`bayer_rggb8`"), "{error}");
        for (step, bytes) in [(3, 5), (3, 7), (2, 4), (u32::MAX, 6), (0, 0)] {
            let error = colour("rgb8", step, &vec![0; bytes]).unwrap_err();
            assert!(error.contains("/colour") && error.contains("bytes"), "{error}");
        }
        let huge = Image { height: u32::MAX, width: u32::MAX, ..image("rgb8", 0, &[]) };
        assert!(Colour::Raw(huge).decode("/colour").is_err());
        let bytes = depth(&image("8UC1", 1, &[0; 2]), "/depth").unwrap_err().to_string();
        assert!(bytes.contains("`8UC1`") && bytes.contains("16UC1"), "{bytes}");
    }
}
