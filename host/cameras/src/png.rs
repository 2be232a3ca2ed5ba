//! PNG files.

use std::io;
use std::path::{Path, PathBuf};

use opencv::core::{Mat, ToInputArray, Vec3b, Vector};
use opencv::imgcodecs::{IMWRITE_PNG_COMPRESSION, imencode};
use plumb_frame::image::{ColourImage, DepthImage};
use thiserror::Error;

use crate::source::BoxedError;
use crate::whole_writes::write_whole;

/// zlib's fastest level: a tenth of the default level's time for a file half as large again.
const COMPRESSION: i32 = 1;

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
/// Where the image has no pixels or memory is short.
pub fn encode_colour(image: &ColourImage) -> Result<Vec<u8>, BoxedError> {
    let [rows, columns] = [image.height() as i32, image.width() as i32];
    encode(&Mat::new_rows_cols_with_bytes::<Vec3b>(rows, columns, image.channels())?)
}

/// Encodes a depth image.
pub(crate) fn encode_depth(image: &DepthImage) -> Result<Vec<u8>, BoxedError> {
    let [rows, columns] = [image.height() as i32, image.width() as i32];
    encode(&Mat::new_rows_cols_with_data(rows, columns, image.pixels())?)
}

/// Encodes a matrix.
fn encode(image: &impl ToInputArray) -> Result<Vec<u8>, BoxedError> {
    let mut bytes = Vector::<u8>::new();
    let options = Vector::from_slice(&[IMWRITE_PNG_COMPRESSION, COMPRESSION]);
    imencode(".png", image, &mut bytes, &options)?;
    Ok(bytes.into())
}
