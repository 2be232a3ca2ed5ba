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
    /// The ball's depth by its outline and by its pixels; `None` without one of the two.
    pub depths: Option<TwoDepths>,
}

/// Depth of the ball's centre along the optical axis by two measurements, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoDepths {
    /// By the size of its outline and the ball's diameter.
    pub by_outline: f64,
    /// By the depth of its pixels.
    pub by_pixels: f64,
}

impl TwoDepths {
    /// Returns the part by which the depth of the pixels is above that of the outline.
    pub fn difference(&self) -> f64 {
        self.by_pixels / self.by_outline - 1.0
    }
}
