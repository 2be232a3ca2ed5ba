//! Intrinsics and the size of the pictures that they belong to.

use thiserror::Error;

use crate::camera::{CalibratedFor, Camera, DistortionError, Intrinsics};
use crate::image::ImageSize;

/// Reason why intrinsics do not fit the pictures of a source.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum UnfitIntrinsics {
    /// The camera file states another size.
    #[error(
        "{origin}: its pictures are {size}, but the intrinsics of the camera file belong to \
         pictures of {calibrated}: choose that size, or calibrate the lens at this one (`plumb \
         calibrate --lens`)"
    )]
    OtherSize {
        /// Camera, recording or address that the pictures come from.
        origin: String,
        /// Size of the pictures.
        size: ImageSize,
        /// Size in the camera file.
        calibrated: ImageSize,
    },
    /// They seem to belong to pictures of another size.
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

/// Intrinsics of a camera file, and the pictures that they belong to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FileIntrinsics {
    /// The intrinsics.
    pub intrinsics: Intrinsics,
    /// Their pictures.
    pub calibrated_for: CalibratedFor,
}

impl From<Intrinsics> for FileIntrinsics {
    /// Returns intrinsics without the size of their pictures.
    fn from(intrinsics: Intrinsics) -> Self {
        Self { intrinsics, calibrated_for: CalibratedFor::Unstated }
    }
}

impl From<&Camera> for FileIntrinsics {
    fn from(camera: &Camera) -> Self {
        Self { intrinsics: camera.intrinsics, calibrated_for: camera.calibrated_for }
    }
}

impl FileIntrinsics {
    /// Returns the intrinsics if they fit the pictures of `origin`, which are of `size`, or if they
    /// are to be estimated from them.
    ///
    /// # Errors
    /// [`UnfitIntrinsics`] where they do not fit.
    pub fn of_pictures(
        self,
        size: ImageSize,
        origin: impl ToString,
    ) -> Result<Intrinsics, UnfitIntrinsics> {
        match self.calibrated_for {
            CalibratedFor::Size(calibrated) if calibrated != size => {
                let origin = origin.to_string();
                return Err(UnfitIntrinsics::OtherSize { origin, size, calibrated });
            }
            CalibratedFor::Size(_) | CalibratedFor::Unstated => {
                check(&self.intrinsics, size, origin)?;
            }
            CalibratedFor::Nothing => {}
        }
        Ok(self.intrinsics)
    }
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
    use crate::camera::{Distortion, DistortionCoefficients};

    use super::*;

    #[test]
    fn a_size_in_the_camera_file_must_be_that_of_the_pictures() {
        let (fx, fy, cx, cy) = (525.0, 525.0, 319.5, 239.5);
        let intrinsics = Intrinsics { fx, fy, cx, cy, depth_scale: 0.0, distortion: None };
        let vga = ImageSize { width: 640, height: 480 };
        let of = |calibrated_for| FileIntrinsics { intrinsics, calibrated_for };
        let stated = of(CalibratedFor::Size(vga));
        assert_eq!(stated.of_pictures(vga, "it"), Ok(intrinsics));
        // The principal point would be plausible.
        let other = ImageSize { width: 800, height: 600 };
        let text = stated.of_pictures(other, "it").unwrap_err().to_string();
        assert!(text.contains("800x600") && text.contains("640x480"), "{text}");
        // A guess is taken whatever the size.
        let hd = ImageSize { width: 1280, height: 720 };
        assert!(of(CalibratedFor::Unstated).of_pictures(hd, "it").is_err());
        assert_eq!(of(CalibratedFor::Nothing).of_pictures(hd, "it"), Ok(intrinsics));
    }

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
