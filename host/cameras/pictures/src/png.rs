//! PNG images, for files.

use ::png::{BitDepth, ColorType, Compression, Encoder};
use plumb_frame::image::{ColourImage, DepthImage, ImageSize};

use crate::BoxedError;

/// Encodes a colour image.
///
/// # Errors
/// Where the image has no pixels, or more than 2^32 - 1 columns or rows.
pub fn encode_colour(image: &ColourImage) -> Result<Vec<u8>, BoxedError> {
    let rgb: Vec<[u8; 3]> = image.pixels().iter().map(|&[b, g, r]| [r, g, b]).collect();
    encode(image.size(), ColorType::Rgb, BitDepth::Eight, rgb.as_flattened())
}

/// Encodes a depth image.
///
/// # Errors
/// As [`encode_colour`].
pub fn encode_depth(image: &DepthImage) -> Result<Vec<u8>, BoxedError> {
    let bytes: Vec<[u8; 2]> = image.pixels().iter().map(|depth| depth.to_be_bytes()).collect();
    encode(image.size(), ColorType::Grayscale, BitDepth::Sixteen, bytes.as_flattened())
}

/// Encodes rows of samples.
fn encode(
    size: ImageSize,
    kind: ColorType,
    depth: BitDepth,
    rows: &[u8],
) -> Result<Vec<u8>, BoxedError> {
    let (width, height) = (size.width.try_into()?, size.height.try_into()?);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(kind);
    encoder.set_depth(depth);
    // A recording needs speed more than small files.
    encoder.set_compression(Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rows)?;
    writer.finish()?;
    Ok(bytes)
}
