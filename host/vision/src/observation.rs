//! The ball as one frame shows it.

use nalgebra::{Matrix2, Matrix3, Point3};

use crate::camera::Camera;
use crate::frame::RgbdFrame;
use crate::localise::localise;

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

/// The ball as a detector observes it in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallObservation {
    /// When the frame was taken, seconds on the source's clock.
    pub stamp: f64,
    /// The ball in the image.
    pub circle: Circle,
    /// Confidence; larger is surer. The scale is the detector's own.
    pub score: f64,
    /// The ball's centre in the rig frame; `None` if too little of the disc has depth.
    pub position: Option<Gaussian3>,
}

impl BallObservation {
    /// Makes the observation of a ball that is seen as `circle`, with the position that the
    /// frame's depth gives (see [`localise`]).
    pub fn new(circle: Circle, score: f64, frame: &RgbdFrame, camera: &Camera) -> Self {
        let position = localise(&circle, frame, camera);
        Self { stamp: frame.time(), circle, score, position }
    }
}
