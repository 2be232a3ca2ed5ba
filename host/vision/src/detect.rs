//! Detectors: they find the ball in a frame.
//!
//! Their interface is in [`plumb_frame::detect`].

pub mod ball;
pub mod disc;
pub mod red;
#[cfg(test)]
mod scene;
pub mod shape;
#[cfg(test)]
mod tests;

use crate::camera::Camera;
use ball::ShapeDetector;
use disc::DiscDetector;
use red::RedDetector;

pub use plumb_frame::detect::{BallDetector, DetectError, StageImage};

/// The detectors of this crate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum DetectorKind {
    /// Depth and a network propose; edges, depth and two networks decide.
    ///
    /// See [`ShapeDetector`].
    Ball,
    /// A flat disc, as of a wall plotter's gondola, for a camera without depth.
    ///
    /// See [`DiscDetector`].
    Disc,
    /// The paper's: difference of Gaussians on the red channel.
    ///
    /// See [`RedDetector`].
    Red,
}

/// Distance of the ball from the camera that [`DetectorKind::Red`] expects, metres: the middle of
/// the demo. That detector searches for one size of the ball in the image only.
const RED_DISTANCE_M: f64 = 1.25;

impl DetectorKind {
    /// All detectors.
    pub const ALL: [Self; 3] = [Self::Ball, Self::Disc, Self::Red];

    /// Returns the name, as [`BallDetector::name`] does.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ball => "ball",
            Self::Disc => "disc",
            Self::Red => "red",
        }
    }

    /// Makes the detector for `camera` and its ball.
    pub fn build(self, camera: &Camera) -> Box<dyn BallDetector> {
        match self {
            Self::Ball => Box::new(ShapeDetector::new(camera)),
            Self::Disc => Box::new(DiscDetector::new(camera)),
            Self::Red => Box::new(RedDetector::at_distance(camera, RED_DISTANCE_M)),
        }
    }
}
