//! The paper's model of the rig: rigid cables that are always taut, even where one would have to
//! push.

use nalgebra::{Matrix3, Point3, Vector3};
use plumb_emulator::plant::{Geometry, Plant, RigError};
use plumb_protocol::{MOTORS, PerMotor};

/// A ball at the common end of three rigid rods of variable length. [`Plant::slack`] reports a rod
/// under pressure, which would be a slack cable; the ball moves as if the cable were a rod. If the
/// rods are too short to meet, the ball lies in the motors' plane.
#[derive(Debug, Clone)]
pub(super) struct Kinematic {
    geometry: Geometry,
    start_m: PerMotor<f64>,
    ball: Point3<f64>,
}

impl Kinematic {
    /// Creates the rig with its ball at `start` (metres, rig frame).
    pub(super) fn new(geometry: Geometry, start: Point3<f64>) -> Self {
        Self { geometry, start_m: geometry.cable_lengths_m(&start), ball: start }
    }

    /// Returns the lower of the two points with these distances (metres) from motors A, B and C.
    /// The spheres around A and B and around A and C give its projection into the motors' plane;
    /// the length of A's cable gives its distance below the plane.
    fn lowest_point(&self, lengths: PerMotor<f64>) -> Option<Point3<f64>> {
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
    fn advance(&mut self, _dt_s: f64, motors: PerMotor<f64>) -> Result<(), RigError> {
        let steps = self.geometry.step_lengths_m();
        let lengths_m = std::array::from_fn(|i| self.start_m[i] + steps[i] * motors[i]);
        self.ball = self.lowest_point(lengths_m).ok_or(RigError::TooShortTogether { lengths_m })?;
        Ok(())
    }

    fn ball(&self) -> Point3<f64> {
        self.ball
    }

    fn slack(&self) -> PerMotor<bool> {
        self.geometry
            .tensions_per_weight(&self.ball)
            .map_or([true; MOTORS], |tensions| tensions.map(|t| t < 0.0))
    }
}
