//! Frames with known truth.

use nalgebra::Point3;
use plumb_vision::frame::RgbdFrame;

/// A frame and the truth about its ball.
pub struct LabelledFrame {
    /// The frame.
    pub frame: RgbdFrame,
    /// The ball in it; `None` if there is none.
    pub ball: Option<GroundTruth>,
}

/// True position of a ball.
#[derive(Debug, Clone, Copy)]
pub struct GroundTruth {
    /// Column of the projected centre, pixels.
    pub u: f64,
    /// Row of the projected centre, pixels.
    pub v: f64,
    /// Radius in the frame, pixels.
    pub radius: f64,
    /// Centre, rig frame, metres.
    pub centre: Point3<f64>,
}
