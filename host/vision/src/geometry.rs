//! A circle in the image and a distribution in space.

use nalgebra::{Matrix2, Matrix3, Point3};

/// The ball's disc in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Column of the ball's centre, pixels (the centre of the left-most pixel is 0).
    pub u: f64,
    /// Row of the ball's centre, pixels.
    pub v: f64,
    /// Radius, pixels.
    pub radius: f64,
    /// Covariance of column and row, pixels².
    pub covariance: Matrix2<f64>,
}

impl Circle {
    /// Makes a circle whose centre has a standard deviation of a quarter of the radius in either
    /// direction.
    pub fn rough(u: f64, v: f64, radius: f64) -> Self {
        Self { u, v, radius, covariance: Matrix2::identity() * (radius / 4.0).powi(2) }
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
