//! Finding the ball in a picture.

use std::error::Error;

use nalgebra::Matrix2;
use thiserror::Error;

use crate::frame::RgbdFrame;

mod around;
pub mod ball;
mod coarse;
mod colour;
mod edge;
mod evidence;
mod judge;
mod outline;
mod picture;
mod propose;
mod rays;
pub mod red;
mod round;
#[cfg(test)]
mod scene;
mod sphere;
#[cfg(test)]
mod tests;

/// The ball as it is seen in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Column of the ball's centre, pixels (the centre of the left-most pixel is 0).
    pub u: f64,
    /// Row of the ball's centre, pixels.
    pub v: f64,
    /// Radius of its disc, pixels.
    pub radius: f64,
    /// How sure it is, larger is surer; the scale is the detector's own.
    pub score: f64,
    /// Covariance of column and row, pixels².
    pub covariance: Matrix2<f64>,
}

impl Detection {
    /// A ball at (`u`, `v`) of `radius` pixels, known no better than to a quarter of its radius
    /// (standard deviation).
    pub fn new(u: f64, v: f64, radius: f64, score: f64) -> Self {
        Self { u, v, radius, score, covariance: Matrix2::identity() * (radius / 4.0).powi(2) }
    }
}

/// Reasons why a frame could not be searched (a frame without a ball is not an error).
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DetectError {
    /// An operation on an image failed, for example for lack of memory.
    #[error("image processing failed: {0}")]
    Processing(#[source] Box<dyn Error + Send + Sync>),
}

impl DetectError {
    /// Wraps the error of the library that a detector processes images with.
    pub fn processing(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Processing(error.into())
    }
}

/// Something that finds the ball.
pub trait Detector {
    /// Its name, as in the configuration.
    fn name(&self) -> &'static str;

    /// The ball in `frame`, or `None` where there is none.
    ///
    /// # Errors
    /// Where the picture could not be searched.
    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<Detection>, DetectError>;

    /// Forgets where the ball was: the next picture is searched like a first one.
    fn reset(&mut self) {}
}
