//! Intrinsics and the size of the pictures that they belong to.

use plumb_frame::camera::Intrinsics;
use plumb_frame::image::ImageSize;

/// Returns whether `intrinsics` may belong to pictures of `size`: a principal point far from the
/// middle belongs to another resolution.
pub(super) fn fits(intrinsics: &Intrinsics, size: ImageSize) -> bool {
    let is_central = |point: f64, pixels: usize| (0.25..0.75).contains(&(point / pixels as f64));
    is_central(intrinsics.cx, size.width) && is_central(intrinsics.cy, size.height)
}
