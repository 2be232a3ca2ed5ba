//! Decoding of images: PNG, JPEG, PGM and PPM, and depth in RVL. Images that are too large are
//! refused before they are decoded.
//!
//! A PNG file of 100 kB may have 30000 x 30000 pixels, which take gigabytes when decoded.
//!
//! The pixels are those that the file stores: nothing turns them (EXIF), and no colour profile
//! changes them. Transparency is left out.

mod error;
mod jpeg;
mod netpbm;
mod png;
mod rvl;
mod samples;

use plumb_frame::image::{ColourImage, DepthImage, Image, ImageSize};

use error::NO_DEPTH;

pub use error::{DecodeError, MAX_PIXELS};
pub use rvl::rvl_depth;

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

/// Decodes an image file of `size`. Another size is refused before it is decoded.
///
/// # Errors
/// Where it has another size; as `decode`, which is [`colour`] or [`depth`].
pub fn of_size<P: Copy>(
    bytes: &[u8],
    size: ImageSize,
    decode: impl Fn(&[u8]) -> Result<Image<P>, DecodeError>,
) -> Result<Image<P>, DecodeError> {
    match self::size(bytes).ok_or(DecodeError::Damaged)? {
        stated if stated == size => decode(bytes),
        stated => Err(DecodeError::OtherSize { size: stated, expected: size }),
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

#[cfg(test)]
mod tests;
