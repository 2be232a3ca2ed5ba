//! Straight paths of the ball in one rig.

use plumb_protocol::{PerAxis, PerMotor};

use super::{Interval, RigFamily, RigFamilyError};
use crate::rig_family::Cell;

/// A straight path of the ball between two points, in one rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallPath {
    /// W/D.
    w: Interval,
    /// t.
    t: Interval,
    /// λ_A, λ_C and h/D at both ends.
    ends: [[Interval; 3]; 2],
}

impl BallPath {
    /// Returns the path from `start` to `target` between the motors A, B, C; m, rig frame.
    ///
    /// # Errors
    /// [`RigFamilyError`] if the motors are not a rig, or if an end of the path is outside their
    /// triangle or not below them.
    pub fn new(
        motors: &PerMotor<PerAxis<f64>>,
        start: PerAxis<f64>,
        target: PerAxis<f64>,
    ) -> Result<Self, RigFamilyError> {
        let below = Interval::point(motors[0][2] - start[2].min(target[2]));
        let rig = RigFamily::around(motors, 0.0, 0.0, below)?;
        let [a, b, _] = motors.map(|motor| motor.map(Interval::point));
        let normalised = |p: PerAxis<f64>| {
            let [x, y, z] = p.map(Interval::point);
            let lambda_c = (a[0] - x) / rig.width;
            let lambda_a = (y - b[1]) / rig.depth - lambda_c * rig.apex;
            [lambda_a, lambda_c, (a[2] - z) / rig.depth]
        };
        let ends = [normalised(start), normalised(target)];
        let inside = |[lambda_a, lambda_c, h]: [Interval; 3]| {
            lambda_a.lo > 0.0 && lambda_c.lo > 0.0 && (lambda_a + lambda_c).hi < 1.0 && h.lo > 0.0
        };
        if !ends.into_iter().all(inside) {
            return Err(RigFamilyError::Outside(start, target));
        }
        Ok(Self { w: rig.width / rig.depth, t: rig.apex, ends })
    }

    /// Encloses the ball from `part.lo` to `part.hi` of the path; 0 is the start, 1 the target.
    pub(super) fn cell(&self, part: Interval) -> Cell {
        let [start, target] = self.ends;
        let along = |n: usize| start[n] + part * (target[n] - start[n]);
        Cell([self.w, self.t, along(0), along(1), along(2)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOTORS: PerMotor<PerAxis<f64>> =
        [[0.85, 0.61, 0.665], [0.85, 0.0, 0.665], [0.0, 0.24, 0.665]];

    #[test]
    fn a_path_that_leaves_the_triangle_is_refused() {
        assert!(BallPath::new(&MOTORS, [0.540, 0.220, 0.459], [0.2, 0.6, 0.15]).is_err());
        assert!(BallPath::new(&MOTORS, [0.540, 0.220, 0.459], [0.4, 0.4, 0.7]).is_err());
    }
}
