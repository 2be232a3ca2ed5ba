//! A measurement in the units of the filters.

use super::geometry::Vector;
use crate::law::io::Measurement;

/// What a measurement says.
pub(super) struct Seen {
    /// The ball, mm.
    pub(super) ball: Vector,
    /// How sure that is along each axis, mm².
    pub(super) variances: Vector,
    /// Where the motors were, steps.
    pub(super) motors: Vector,
    /// What they turned in a measurement's time before that, steps.
    pub(super) turned: Vector,
    /// And how much more than in the one before.
    pub(super) faster: Vector,
}

impl Seen {
    pub(super) fn of(measurement: &Measurement) -> Self {
        let [before, earlier] = measurement.motors_before;
        let (turned, earlier) = (steps(before, measurement.motors), steps(earlier, before));
        Self {
            ball: millimetres(measurement.ball),
            variances: measurement.variances.map(|v| v as f32 * 1e-6),
            motors: steps([0; 3], measurement.motors),
            turned,
            faster: [0, 1, 2].map(|k| turned[k] - earlier[k]),
        }
    }
}

/// From one place of the motors (1/16 steps) to another, steps.
pub(super) fn steps(from: [i32; 3], to: [i32; 3]) -> Vector {
    [0, 1, 2].map(|k| (to[k] - from[k]) as f32 / 16.0)
}

pub(super) fn millimetres(p: [i32; 3]) -> Vector {
    p.map(|p| p as f32 / 1000.0)
}
