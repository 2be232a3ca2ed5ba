//! A measurement in the law's units.

use plumb_protocol::dimension::{MOTORS, PerAxis, PerMotor};

use super::geometry::Vector;
use crate::law::io::Measurement;
use crate::vector::per_motor;

/// A position of the ball and the motors' movement before it.
pub(super) struct Observation {
    /// Position of the ball, mm.
    pub(super) ball: Vector,
    /// Variances of `ball` along each axis, mm².
    pub(super) variances: Vector,
    /// Motor positions at the capture, steps.
    pub(super) motors: Vector,
    /// Movement of the motors in the frame time before that, steps.
    pub(super) turned: Vector,
    /// `turned` minus the movement in the frame time before, steps.
    pub(super) faster: Vector,
    /// Whether the target moves.
    pub(super) is_following: bool,
}

impl Observation {
    /// Converts a measurement.
    pub(super) fn new(measurement: &Measurement) -> Self {
        let [before, earlier] = measurement.motors_before;
        let (turned, earlier) = (steps(before, measurement.motors), steps(earlier, before));
        Self {
            ball: millimetres(measurement.ball),
            variances: measurement.variances.map(|v| v as f32 * 1e-6),
            motors: steps([0; MOTORS], measurement.motors),
            turned,
            faster: per_motor(|k| turned[k] - earlier[k]),
            is_following: measurement.is_moving(),
        }
    }
}

/// Returns the steps between two motor positions (Q4 steps).
pub(super) fn steps(from: PerMotor<i32>, to: PerMotor<i32>) -> Vector {
    per_motor(|k| (to[k] - from[k]) as f32 / 16.0)
}

/// Converts a point from µm to mm.
pub(super) fn millimetres(p: PerAxis<i32>) -> Vector {
    p.map(|p| p as f32 / 1000.0)
}
