//! Finding the ball in a picture.

use std::error::Error;

use thiserror::Error;

use crate::camera::Camera;
use crate::frame::RgbdFrame;
use crate::observation::BallObservation;
use ball::ShapeDetector;
use red::RedDetector;

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

/// A detector: finds the ball in a frame.
pub trait BallDetector {
    /// Returns the detector's name, as in the configuration.
    fn name(&self) -> &'static str;

    /// Returns the observation of the ball in `frame`; `None` if there is no ball.
    ///
    /// # Errors
    /// Returns an error if the frame could not be searched.
    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError>;

    /// Forgets where the ball was: the next frame is searched like a first one.
    fn reset(&mut self) {}
}

/// The detectors of this crate, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DetectorKind {
    /// [`ShapeDetector`]: colour proposes, shape and size decide.
    Ball,
    /// [`RedDetector`], the paper's: a difference of Gaussians on the red channel.
    Red,
}

/// Distance of the ball from the camera that [`DetectorKind::Red`] expects, metres: the middle of
/// the demo. That detector knows one size of the ball in the image only.
const RED_DISTANCE_M: f64 = 1.25;

impl DetectorKind {
    /// All detectors.
    pub const ALL: [Self; 2] = [Self::Ball, Self::Red];

    /// Returns the name, as in the configuration.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ball => "ball",
            Self::Red => "red",
        }
    }

    /// Returns the detector called `name`; `None` if there is no such detector.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Makes the detector for `camera` and its ball.
    pub fn build(self, camera: &Camera) -> Box<dyn BallDetector> {
        match self {
            Self::Ball => Box::new(ShapeDetector::new(camera)),
            Self::Red => Box::new(RedDetector::at_distance(camera, RED_DISTANCE_M)),
        }
    }
}
