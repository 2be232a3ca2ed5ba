//! Failures to decode an image.

use plumb_frame::image::{ImageError, ImageSize};
use thiserror::Error;

/// Most pixels of an image. Colour and depth of that size take 250 MB, and up to 300 MB more while
/// they are decoded.
pub const MAX_PIXELS: u64 = 50_000_000;

/// Failure to decode an image.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The bytes are no image, or a damaged one.
    #[error("not a picture (PNG, JPEG, PGM or PPM), or a damaged one")]
    Damaged,
    /// A JPEG image has no end. Its missing rows are unknown.
    #[error("a part of the JPEG picture is missing: it has no end (the bytes ff d9)")]
    Truncated,
    /// A JPEG image of a kind that is not decoded.
    #[error("a JPEG picture {kind}, which is not read; save it as a baseline JPEG in RGB or grey")]
    OtherJpeg {
        /// What sets it apart.
        kind: &'static str,
    },
    /// A depth image in RVL is damaged.
    #[error("no depth picture in RVL, or a damaged one")]
    Rvl,
    /// The image has too many pixels.
    #[error("{size} pixels; at most {MAX_PIXELS} are decoded")]
    TooManyPixels {
        /// Size of the image.
        size: ImageSize,
    },
    /// The pixels have another type than the frame needs.
    #[error("{must}")]
    PixelType {
        /// Required type.
        must: &'static str,
    },
    /// The image has another size than it must have.
    #[error("a picture of {size}, but it must be {expected}")]
    OtherSize {
        /// Size of the image.
        size: ImageSize,
        /// Required size.
        expected: ImageSize,
    },
    /// The decoded image has another number of pixels than its size.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// Image that has no depth.
pub(super) const NO_DEPTH: DecodeError =
    DecodeError::PixelType { must: "the depth picture must be 16-bit with one channel" };
