//! How a ball's disc is stretched off the optical axis.

use nalgebra::Matrix2;

use super::view::Disc;
use crate::camera::Intrinsics;

/// How perspective and lens stretch a ball's disc.
///
/// Places on the disc are to the right of its centre and down, in pixels of its radius. Off the
/// optical axis the disc is an ellipse; a row of places is a row of pixels all the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stretch {
    /// Columns for each pixel to the right.
    right: f64,
    /// Columns for each pixel down.
    shear: f64,
    /// Rows for each pixel down.
    down: f64,
}

impl Stretch {
    /// A disc on the optical axis.
    const NONE: Self = Self { right: 1.0, shear: 0.0, down: 1.0 };

    /// Returns the stretch of a small ball that `intrinsics` show at column `u`, row `v`. Where a
    /// distortion folds there is none.
    ///
    /// In focal lengths from the principal point, a ball of radius R at depth z in the direction
    /// (x, y, 1) is the ellipse p' S⁻¹ p < (R/z)², S = 1 + (x, y)' (x, y). Pixels turn S into
    /// D S D' with their derivatives D.
    pub(super) fn new(intrinsics: &Intrinsics, u: f64, v: f64) -> Self {
        let ray = intrinsics.deproject(u, v, 1.0).coords.xy();
        let derivatives = intrinsics.deproject_derivatives(u, v, 1.0);
        let Some(to_pixels) = derivatives.and_then(|inverse| inverse.try_inverse()) else {
            return Self::NONE;
        };
        let to_pixels = to_pixels / intrinsics.focal();
        let squared =
            to_pixels * (Matrix2::identity() + ray * ray.transpose()) * to_pixels.transpose();
        let down = squared.m22.sqrt();
        let shear = squared.m12 / down;
        Self { right: (squared.m11 - shear * shear).sqrt(), shear, down }
    }

    /// Returns column and row of the place `right` and `down` pixels from the centre of `disc`.
    pub(super) fn at(&self, disc: &Disc, right: f64, down: f64) -> (f64, f64) {
        (disc.u + self.right * right + self.shear * down, disc.v + self.down * down)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::camera::{Distortion, DistortionCoefficients};

    #[test]
    fn the_border_of_a_stretched_disc_is_the_ball_s_cone() {
        let barrel = DistortionCoefficients { k1: -0.2, k2: 0.03, p1: 0.001, p2: -0.002, k3: 0.0 };
        for distortion in [None, Distortion::new(barrel)] {
            let intrinsics = Intrinsics {
                fx: 400.0,
                fy: 420.0,
                cx: 310.0,
                cy: 250.0,
                depth_scale: 1000.0,
                distortion,
            };
            for (u, v) in [(310.0, 250.0), (20.0, 250.0), (320.0, 10.0), (600.0, 450.0)] {
                let disc = Disc { u, v, radius: 2.0 };
                let stretch = Stretch::new(&intrinsics, u, v);
                let centre = intrinsics.deproject(u, v, 1.0).coords;
                // The sine of the cone's half angle is the ball's radius over its distance.
                let expected = disc.radius / (intrinsics.focal() * centre.norm());
                for angle in (0..12).map(|k| TAU * f64::from(k) / 12.0) {
                    let (right, down) = (disc.radius * angle.cos(), disc.radius * angle.sin());
                    let (u, v) = stretch.at(&disc, right, down);
                    let sine = centre.angle(&intrinsics.deproject(u, v, 1.0).coords).sin();
                    assert!((sine / expected - 1.0).abs() < 0.01, "{disc:?} {angle}: {sine}");
                }
            }
        }
    }
}
