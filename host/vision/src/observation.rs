//! The ball as one frame shows it.

use crate::camera::Camera;
use crate::frame::RgbdFrame;
use crate::localise::localise;

pub use crate::geometry::{Circle, Gaussian3};

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
