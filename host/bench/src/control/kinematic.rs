//! The rig as the paper takes it to be: rigid cables that are all taut, whatever that asks of them.

use nalgebra::{Matrix3, Point3, Vector3};
use plumb_emulator::rig::{Geometry, Plant, RigError};

/// A ball where three rigid rods of variable length meet. Where one of them pushes, a cable would
/// be slack: [`Plant::slack`] says so, and the ball goes on as if it were not. Where they are too
/// short to meet, the ball is in the motors' plane, until they are longer.
#[derive(Debug, Clone)]
pub(super) struct Kinematic {
    geometry: Geometry,
    start_m: [f64; 3],
    ball: Point3<f64>,
}

impl Kinematic {
    pub(super) fn new(geometry: Geometry, start: Point3<f64>) -> Self {
        Self { geometry, start_m: geometry.cable_lengths_m(&start), ball: start }
    }

    /// The lower of the two points at which the cables have these lengths: where the spheres about
    /// A and B, A and C meet in the motors' plane, and below it by what is left of A's cable.
    fn meet(&self, lengths: [f64; 3]) -> Option<Point3<f64>> {
        let [a, b, c] = *self.geometry.motors();
        let normal = (b - a).cross(&(c - a)).normalize();
        let down = if normal.z > 0.0 { -normal } else { normal };
        // 2 (M - A)·p = l_A² - l_M² + |M - A|² for p from A.
        let level = |m: Point3<f64>, l: f64| {
            0.5 * (lengths[0].powi(2) - l.powi(2) + (m - a).norm_squared())
        };
        let rows =
            Matrix3::from_rows(&[(b - a).transpose(), (c - a).transpose(), down.transpose()]);
        let inside =
            rows.try_inverse()? * Vector3::new(level(b, lengths[1]), level(c, lengths[2]), 0.0);
        let depth = (lengths[0].powi(2) - inside.norm_squared()).max(0.0).sqrt();
        Some(a + inside + down * depth)
    }
}

impl Plant for Kinematic {
    fn advance(&mut self, _dt_s: f64, motors: [f64; 3]) -> Result<(), RigError> {
        let steps = self.geometry.step_lengths_m();
        let lengths_m = [0, 1, 2].map(|i| self.start_m[i] + steps[i] * motors[i]);
        self.ball = self.meet(lengths_m).ok_or(RigError::TooShortTogether { lengths_m })?;
        Ok(())
    }

    fn ball(&self) -> Point3<f64> {
        self.ball
    }

    fn slack(&self) -> [bool; 3] {
        self.geometry
            .tensions_per_weight(&self.ball)
            .map_or([true; 3], |tensions| tensions.map(|t| t < 0.0))
    }
}
