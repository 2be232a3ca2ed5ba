//! Intrinsics and the size of the pictures that they belong to.

use plumb_frame::camera::{DistortionError, Intrinsics};
use plumb_frame::image::ImageSize;
use thiserror::Error;

/// Reason why intrinsics do not fit the pictures of a source.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum UnfitIntrinsics {
    /// They belong to pictures of another size.
    #[error(
        "{origin}: its pictures are {size}, but the principal point of the camera file's \
         intrinsics, ({cx}, {cy}), is far from their middle: was it calibrated at another \
         resolution?"
    )]
    OtherResolution {
        /// Camera, recording or address that the pictures come from.
        origin: String,
        /// Size of the pictures.
        size: ImageSize,
        /// Column of the principal point, pixels.
        cx: f64,
        /// Row of the principal point, pixels.
        cy: f64,
    },
    /// A part of the picture has no ray.
    #[error("{origin}: the lens distortion does not fit its pictures")]
    Distortion {
        /// Camera, recording or address that the pictures come from.
        origin: String,
        /// The part of the picture, and what to do.
        source: DistortionError,
    },
}

/// Checks whether `intrinsics` may belong to the pictures of `origin`, which are of `size`: a
/// principal point far from the middle belongs to another resolution, and each pixel must have a
/// ray.
///
/// # Errors
/// [`UnfitIntrinsics`] where they do not.
pub fn check(
    intrinsics: &Intrinsics,
    size: ImageSize,
    origin: impl ToString,
) -> Result<(), UnfitIntrinsics> {
    let is_central = |point: f64, pixels: usize| (0.25..0.75).contains(&(point / pixels as f64));
    let Intrinsics { cx, cy, .. } = *intrinsics;
    if !(is_central(cx, size.width) && is_central(cy, size.height)) {
        return Err(UnfitIntrinsics::OtherResolution { origin: origin.to_string(), size, cx, cy });
    }
    intrinsics
        .check_distortion(size.width, size.height)
        .map_err(|source| UnfitIntrinsics::Distortion { origin: origin.to_string(), source })
}

#[cfg(test)]
mod tests {
    use plumb_frame::camera::{Distortion, DistortionCoefficients};

    use super::*;

    #[test]
    fn intrinsics_must_fit_the_size_of_the_pictures() {
        let lens = |k1: f64, cx: f64| {
            let coefficients = DistortionCoefficients { k1, ..Default::default() };
            let distortion = Distortion::new(coefficients);
            Intrinsics { fx: 600.0, fy: 600.0, cx, cy: 240.0, depth_scale: 0.0, distortion }
        };
        let size = ImageSize { width: 640, height: 480 };
        assert_eq!(check(&lens(-0.3, 320.0), size, "it"), Ok(()));
        let other = check(&lens(-0.3, 620.0), size, "it");
        assert!(matches!(other, Err(UnfitIntrinsics::OtherResolution { .. })), "{other:?}");
        // From the principal point, the left edge of the picture is farther than the right one.
        let unfit = check(&lens(-0.3, 400.0), size, "it").unwrap_err();
        assert!(
            matches!(&unfit, UnfitIntrinsics::Distortion { source, .. } if source.u < 100.0),
            "{unfit:?}"
        );
    }
}
