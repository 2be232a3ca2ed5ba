//! PNG files.

use std::io;
use std::path::{Path, PathBuf};

use ::png::{BitDepth, ColorType, Compression, Encoder};
use plumb_frame::image::{ColourImage, DepthImage, ImageSize};
use thiserror::Error;

use crate::source::BoxedError;
use crate::whole_writes::write_whole;

/// Failure to write a PNG file.
#[derive(Debug, Error)]
pub enum PngError {
    /// The image could not be encoded.
    #[error("cannot encode {}", .path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: BoxedError,
    },
    /// The file could not be written.
    #[error("cannot write {}", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
}

/// Writes a colour image to a new PNG file, or over an old one.
///
/// # Errors
/// Where the image cannot be encoded or the file cannot be written.
pub fn save(path: &Path, image: &ColourImage) -> Result<(), PngError> {
    let bytes = encode_colour(image)
        .map_err(|source| PngError::Encode { path: path.to_owned(), source })?;
    write_whole(path, &bytes).map_err(|source| PngError::Write { path: path.to_owned(), source })
}

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
