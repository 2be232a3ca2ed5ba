//! Lens of a camera.

use plumb_frame::camera::{Distortion, DistortionCoefficients, is_of_angles};
use plumb_frame::image::ImageSize;

use crate::error::ImportError;

/// Names of OpenCV's model: in ROS, in kalibr, which has four coefficients, with eight, the last
/// three of which may be 0, and for a lens without distortion.
const MODELS: [&str; 5] = ["plumb_bob", "radtan", "rational_polynomial", "none", ""];

/// Largest tangential coefficient that is not doubted: a lens that is tilted by half a degree. The
/// coefficients k3 and k4 of a fisheye lens are mostly above it.
const MAX_TANGENTIAL: f64 = 5e-3;

/// Pinhole camera with the distortion of its lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImportedLens {
    /// Focal length along the rows, pixels.
    pub fx: f64,
    /// Focal length along the columns, pixels.
    pub fy: f64,
    /// Column of the principal point, pixels.
    pub cx: f64,
    /// Row of the principal point, pixels.
    pub cy: f64,
    /// Distortion; `None` for a lens without one.
    pub distortion: Option<Distortion>,
    /// Size of the pictures that the lens was calibrated with; `None` where the file does not say.
    pub size: Option<ImageSize>,
}

impl ImportedLens {
    /// Makes the lens of focal lengths and principal point (fx, fy, cx, cy; pixels) with the
    /// coefficients of a distortion in OpenCV's order.
    ///
    /// # Errors
    /// If a number is not finite, a focal length is not above 0, or there are too few or too many
    /// coefficients.
    pub(crate) fn new(
        pinhole: [f64; 4],
        coefficients: &[f64],
        size: Option<ImageSize>,
    ) -> Result<Self, ImportError> {
        let [fx, fy, cx, cy] = pinhole;
        let is_possible = pinhole.iter().all(|number| number.is_finite()) && fx > 0.0 && fy > 0.0;
        if !is_possible {
            return Err(ImportError::Pinhole { fx, fy, cx, cy });
        }
        let distortion = match coefficients {
            [] => None,
            some => Distortion::new(DistortionCoefficients::from_slice(some)?),
        };
        Ok(Self { fx, fy, cx, cy, distortion, size })
    }

    /// Returns the doubt about tangential coefficients that are too large for those of a lens.
    pub(crate) fn doubt(&self) -> Option<String> {
        let DistortionCoefficients { p1, p2, .. } = self.distortion?.coefficients();
        (p1.abs().max(p2.abs()) > MAX_TANGENTIAL).then(|| {
            format!(
                "p1 is {p1} and p2 is {p2}: those of a lens are below {MAX_TANGENTIAL}. Were they \
                 calibrated as a fisheye lens, whose four coefficients are k1 to k4?"
            )
        })
    }
}

/// Checks that a lens has a model of distortion that Plumb has.
///
/// # Errors
/// [`ImportError::Model`] where it has another one and a distortion.
pub(crate) fn check_model(model: &str, coefficients: &[f64]) -> Result<(), ImportError> {
    let is_straight = !is_of_angles(model) && coefficients.iter().all(|it| *it == 0.0);
    if MODELS.contains(&model) || is_straight {
        return Ok(());
    }
    Err(ImportError::Model { model: model.to_owned() })
}
