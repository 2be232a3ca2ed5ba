//! Intrinsics and the size of the pictures that they belong to.

use plumb_frame::camera::Intrinsics;
use plumb_frame::image::ImageSize;
use thiserror::Error;

/// Intrinsics that belong to pictures of another size.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "{origin}: its pictures are {size}, but the principal point of the camera file's intrinsics, \
     ({cx}, {cy}), is far from their middle: was it calibrated at another resolution?"
)]
pub struct OtherResolution {
    /// Camera, recording or address that the pictures come from.
    pub origin: String,
    /// Size of the pictures.
    pub size: ImageSize,
    /// Column of the principal point, pixels.
    pub cx: f64,
    /// Row of the principal point, pixels.
    pub cy: f64,
}

/// Checks whether `intrinsics` may belong to the pictures of `origin`, which are of `size`: a
/// principal point far from the middle belongs to another resolution.
///
/// # Errors
/// [`OtherResolution`] where they do not.
pub(super) fn check(
    intrinsics: &Intrinsics,
    size: ImageSize,
    origin: impl ToString,
) -> Result<(), OtherResolution> {
    let is_central = |point: f64, pixels: usize| (0.25..0.75).contains(&(point / pixels as f64));
    let Intrinsics { cx, cy, .. } = *intrinsics;
    if is_central(cx, size.width) && is_central(cy, size.height) {
        return Ok(());
    }
    Err(OtherResolution { origin: origin.to_string(), size, cx, cy })
}
