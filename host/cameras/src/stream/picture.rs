//! Frames from the bytes of a stream.

use std::fmt;

use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::{ColourImage, DepthImage, Image, ImageSize};
use plumb_frame::source::{InvalidFrame, SourceError};
use plumb_pictures::decode::{self, DecodeError};
use plumb_pictures::raw;

use super::error::StreamError;
use super::header::{ColourEncoding, DepthEncoding, Header, Part};
use super::receiver::RawFrame;

/// Format of all frames of a stream, as the first one has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Format {
    /// Size of both pictures.
    pub size: ImageSize,
    /// Intrinsics, with the depth scale of the stream.
    pub intrinsics: Intrinsics,
    /// Encoding of the first frame's colour.
    pub colour: ColourEncoding,
    /// Encoding of the first frame's depth.
    pub depth: DepthEncoding,
}

impl Format {
    /// Returns the format of the stream whose first frame has this header. Without depth in it, the
    /// stream is a camera without depth: its depth scale is 0, whatever the header states.
    pub(super) fn of(header: &Header, intrinsics: Intrinsics) -> Self {
        let depth_scale = match header.depth {
            DepthEncoding::None => 0.0,
            DepthEncoding::Z16 | DepthEncoding::Png16 => {
                header.depth_scale.unwrap_or(intrinsics.depth_scale)
            }
        };
        let intrinsics = Intrinsics { depth_scale, ..intrinsics };
        let Header { colour, depth, .. } = *header;
        Self { size: header.size(), intrinsics, colour, depth }
    }

    /// Decodes a frame.
    ///
    /// # Errors
    /// Where it has another format, or a picture cannot be decoded.
    pub(super) fn frame(&self, raw: RawFrame) -> Result<RgbdFrame, SourceError> {
        let time = raw.time;
        let (colour, depth) = self.pictures(raw).map_err(SourceError::new)?;
        let frame = RgbdFrame::new(time, colour, depth, self.intrinsics);
        Ok(frame.map_err(InvalidFrame::of("stream"))?)
    }

    fn pictures(&self, raw: RawFrame) -> Result<(ColourImage, DepthImage), StreamError> {
        let (size, first) = (raw.header.size(), self.size);
        if size != first {
            return Err(StreamError::OtherSize { size, first });
        }
        if raw.header.depth != DepthEncoding::None
            && let Some(scale) = raw.header.depth_scale
            && scale != self.intrinsics.depth_scale
        {
            let first = self.intrinsics.depth_scale;
            return Err(StreamError::OtherScale { scale, first });
        }
        let failure = |part| move |error| StreamError::Decode { part, error };
        let colour = colour(raw.header.colour, raw.colour, size);
        let depth = depth(raw.header.depth, &raw.depth, size);
        Ok((colour.map_err(failure(Part::Colour))?, depth.map_err(failure(Part::Depth))?))
    }
}

impl fmt::Display for Format {
    /// Writes size and encodings.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, colour {}, depth {}", self.size, self.colour, self.depth)?;
        match self.depth {
            DepthEncoding::None => Ok(()),
            _ => write!(f, " ({} units in a metre)", self.intrinsics.depth_scale),
        }
    }
}

/// Decodes a colour picture of `size`.
fn colour(
    encoding: ColourEncoding,
    bytes: Vec<u8>,
    size: ImageSize,
) -> Result<ColourImage, DecodeError> {
    let pixels = match encoding {
        ColourEncoding::Rgb8 => raw::bgr_of_rgb(&bytes),
        ColourEncoding::Bgr8 => bytes.as_chunks().0.to_vec(),
        ColourEncoding::Jpeg | ColourEncoding::Png => {
            return decode::of_size(&bytes, size, decode::colour);
        }
    };
    Ok(Image::new(size.width, size.height, pixels)?)
}

/// Decodes a depth picture of `size`. Without depth, all of it is unknown.
fn depth(
    encoding: DepthEncoding,
    bytes: &[u8],
    size: ImageSize,
) -> Result<DepthImage, DecodeError> {
    match encoding {
        DepthEncoding::None => Ok(Image::filled(size.width, size.height, 0)),
        DepthEncoding::Png16 => decode::of_size(bytes, size, decode::depth).map(raw::known_depth),
        DepthEncoding::Z16 => {
            Ok(Image::new(size.width, size.height, raw::depth_of_numbers(bytes, true))?)
        }
    }
}
