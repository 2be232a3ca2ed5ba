//! A circle in the image and a distribution in space.

use std::fmt;

use nalgebra::{Matrix3, Point3};

/// The ball's disc in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Column of the ball's centre, pixels (the centre of the left-most pixel is 0).
    pub u: f64,
    /// Row of the ball's centre, pixels.
    pub v: f64,
    /// Radius, pixels.
    pub radius: f64,
    /// Covariance of column, row and radius, pixels².
    pub covariance: Matrix3<f64>,
}

impl Circle {
    /// Makes a circle whose column, row and radius have a standard deviation of a quarter of the
    /// radius.
    pub fn rough(u: f64, v: f64, radius: f64) -> Self {
        Self { u, v, radius, covariance: Matrix3::identity() * (radius / 4.0).powi(2) }
    }
}

impl fmt::Display for Circle {
    /// Writes "(u, v), radius r px".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { u, v, radius, .. } = self;
        write!(f, "({u:.2}, {v:.2}), radius {radius:.2} px")
    }
}

/// A normal distribution of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaussian3 {
    /// Mean, metres.
    pub mean: Point3<f64>,
    /// Covariance, metres².
    pub covariance: Matrix3<f64>,
}

impl Gaussian3 {
    /// Returns the standard deviations along x, y and z, metres.
    pub fn standard_deviations(&self) -> [f64; 3] {
        self.covariance.diagonal().map(f64::sqrt).into()
    }
}

impl fmt::Display for Gaussian3 {
    /// Writes the mean and the standard deviations: "(x, y, z) ± (sx, sy, sz) m".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([x, y, z], [sx, sy, sz]) = (self.mean.into(), self.standard_deviations());
        write!(f, "({x:.4}, {y:.4}, {z:.4}) ± ({sx:.4}, {sy:.4}, {sz:.4}) m")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_written_in_pixels_and_a_position_in_metres() {
        let circle = Circle::rough(319.5, 239.25, 20.0);
        assert_eq!(circle.to_string(), "(319.50, 239.25), radius 20.00 px");
        let covariance = Matrix3::from_diagonal(&[1e-6, 4e-6, 9e-6].into());
        let position = Gaussian3 { mean: Point3::new(0.4, -0.1, 0.15), covariance };
        let text = "(0.4000, -0.1000, 0.1500) ± (0.0010, 0.0020, 0.0030) m";
        assert_eq!(position.to_string(), text);
    }
}
