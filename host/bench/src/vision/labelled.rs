//! Frames with known truth.

use nalgebra::Point3;
use plumb_vision::frame::RgbdFrame;

/// A frame and the truth about its ball.
pub(super) struct LabelledFrame {
    /// The frame.
    pub(super) frame: RgbdFrame,
    /// The ball in it; `None` if there is none.
    pub(super) ball: Option<GroundTruth>,
}

/// True position of a ball.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroundTruth {
    /// Column of the projected centre, pixels.
    pub(super) u: f64,
    /// Row of the projected centre, pixels.
    pub(super) v: f64,
    /// Radius in the frame, pixels.
    pub(super) radius: f64,
    /// Centre, rig frame, metres.
    pub(super) centre: Point3<f64>,
}
