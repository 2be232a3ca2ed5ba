//! PNG files.

use std::io;
use std::path::{Path, PathBuf};

use plumb_config::whole_writes::write_whole;
use plumb_frame::image::ColourImage;
use plumb_frame::source::BoxedError;
use plumb_pictures::png::encode_colour;
use thiserror::Error;

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
