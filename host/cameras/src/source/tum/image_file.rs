//! Image files of a recording.

use std::path::Path;

use plumb_frame::image::{ColourImage, DepthImage};
use plumb_pictures::decode;

use super::error::TumError;
use plumb_config::bounded_read;

/// Most bytes of an image file: an uncompressed image of [`decode::MAX_PIXELS`], and a reserve.
pub const MAX_BYTES: u64 = 1 << 28;

/// Reads the colour image in the file at `path`.
///
/// # Errors
/// Where the file cannot be read, is no regular file, or is larger than [`MAX_BYTES`]; as
/// [`decode::colour`].
pub(super) fn read_colour(path: &Path) -> Result<ColourImage, TumError> {
    let bytes = bounded_read::read(path, MAX_BYTES)?;
    decode::colour(&bytes).map_err(|error| TumError::decode(path, error))
}

/// Reads the depth image (16-bit, one channel) in the file at `path`.
///
/// # Errors
/// As [`read_colour`].
pub(super) fn read_depth(path: &Path) -> Result<DepthImage, TumError> {
    let bytes = bounded_read::read(path, MAX_BYTES)?;
    decode::depth(&bytes).map_err(|error| TumError::decode(path, error))
}
