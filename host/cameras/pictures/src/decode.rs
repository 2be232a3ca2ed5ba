//! Decoding of images: PNG, JPEG, PGM and PPM, and depth in RVL. Images that are too large are
//! refused before they are decoded.
//!
//! A PNG file of 100 kB may have 30000 x 30000 pixels, which take gigabytes when decoded.
//!
//! The pixels are those that the file stores: nothing turns them (EXIF), and no colour profile
//! changes them. Transparency is left out.

mod jpeg;
mod netpbm;
mod png;
mod rvl;

use plumb_frame::image::{Bgr, ColourImage, DepthImage, ImageError, ImageSize};
use thiserror::Error;

pub use rvl::rvl_depth;

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
const NO_DEPTH: DecodeError =
    DecodeError::PixelType { must: "the depth picture must be 16-bit with one channel" };

/// Decodes a colour image. Grey becomes equal blue, green and red. Samples of other than 8 bits
/// are scaled to 0 to 255 and rounded.
///
/// # Errors
/// Where the bytes are no PNG, JPEG, PGM or PPM, damaged or truncated, or a JPEG of an unusual
/// kind; where the image is larger than [`MAX_PIXELS`].
pub fn colour(bytes: &[u8]) -> Result<ColourImage, DecodeError> {
    match header(bytes)? {
        Header::Png(size) => png::colour(bytes, size),
        Header::Jpeg(header) => jpeg::colour(bytes, &header),
        Header::Netpbm(header) => netpbm::colour(&header),
    }
}

/// Decodes a depth image (16-bit, one channel): PNG or PGM.
///
/// # Errors
/// As [`colour`]; where the pixels have another type.
pub fn depth(bytes: &[u8]) -> Result<DepthImage, DecodeError> {
    match header(bytes)? {
        Header::Png(size) => png::depth(bytes, size),
        Header::Jpeg(_) => Err(NO_DEPTH),
        Header::Netpbm(header) => netpbm::depth(&header),
    }
}

/// Returns the size in the header of an image; `None` where the bytes are no PNG, JPEG, PGM or PPM,
/// or damaged.
pub fn size(bytes: &[u8]) -> Option<ImageSize> {
    Header::read(bytes).map(|header| header.size())
}

/// Returns whether an image has grey pixels, by its header; `false` where the bytes are no image.
pub fn is_grey(bytes: &[u8]) -> bool {
    match Header::read(bytes) {
        Some(Header::Png(_)) => png::is_grey(bytes),
        Some(Header::Jpeg(header)) => header.is_grey(),
        Some(Header::Netpbm(header)) => header.is_grey(),
        None => false,
    }
}

/// Header of an image.
enum Header<'a> {
    Png(ImageSize),
    Jpeg(jpeg::Header<'a>),
    Netpbm(netpbm::Header<'a>),
}

impl<'a> Header<'a> {
    /// Reads the header of an image, which has at least one pixel.
    fn read(bytes: &'a [u8]) -> Option<Self> {
        let png = || png::size(bytes).map(Self::Png);
        let jpeg = || jpeg::Header::read(bytes).map(Self::Jpeg);
        let netpbm = || netpbm::Header::read(bytes).map(Self::Netpbm);
        let header = png().or_else(jpeg).or_else(netpbm)?;
        let ImageSize { width, height } = header.size();
        (width > 0 && height > 0).then_some(header)
    }

    fn size(&self) -> ImageSize {
        match self {
            Self::Png(size) => *size,
            Self::Jpeg(header) => header.size(),
            Self::Netpbm(header) => header.size(),
        }
    }
}

/// Reads the header of an image that is not too large.
fn header(bytes: &[u8]) -> Result<Header<'_>, DecodeError> {
    let header = Header::read(bytes).ok_or(DecodeError::Damaged)?;
    let size = header.size();
    match (size.width as u64).checked_mul(size.height as u64) {
        Some(0..=MAX_PIXELS) => Ok(header),
        _ => Err(DecodeError::TooManyPixels { size }),
    }
}

/// Scales a sample of 0 to `largest` to 8 bits, rounded.
fn eight_bits(sample: u16, largest: u16) -> u8 {
    ((u32::from(sample) * 255 + u32::from(largest) / 2) / u32::from(largest)) as u8
}

/// Returns the pixels of 8-bit samples: grey (1 channel), grey and alpha (2), red, green and blue
/// (3), or these and alpha (4).
fn pixels(samples: &[u8], channels: usize) -> Vec<Bgr> {
    match channels {
        1 => samples.iter().map(|&grey| [grey; 3]).collect(),
        2 => samples.as_chunks().0.iter().map(|&[grey, _]| [grey; 3]).collect(),
        3 => samples.as_chunks().0.iter().map(|&[r, g, b]| [b, g, r]).collect(),
        _ => samples.as_chunks().0.iter().map(|&[r, g, b, _]| [b, g, r]).collect(),
    }
}

#[cfg(test)]
mod tests;
