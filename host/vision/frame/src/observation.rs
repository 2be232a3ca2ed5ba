//! The ball as one frame shows it.

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
    /// The ball's centre in the rig frame; `None` if too little of the disc has depth. Of a camera
    /// without depth it follows from the size of the disc.
    pub position: Option<Gaussian3>,
}
