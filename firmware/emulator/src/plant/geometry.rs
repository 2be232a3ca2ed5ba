//! Positions of the motors, cable per step, and the exact kinematics.

use nalgebra::{Matrix3, Point3, Vector3};
use plumb_protocol::{MOTORS, PerMotor};

use super::interface::{NAMES, RigError, check};

/// Full steps per revolution of a common stepper motor (1.8 degrees per step).
pub const FULL_STEPS_PER_REVOLUTION: f64 = 200.0;

/// Smallest area of the triangle of motors as seen from above, m².
const LEAST_AREA_M2: f64 = 1e-6;

/// Three motors and their pulleys. In this model, the cables leave from the motor points for every
/// pulley radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry {
    motors: PerMotor<Point3<f64>>,
    pulley_radii_m: PerMotor<f64>,
}

impl Geometry {
    /// Creates a rig with its motors A, B, C at these points (metres, rig frame; usually at one
    /// height) and pulleys of these radii (metres, > 0).
    ///
    /// # Errors
    /// If a number is not finite, a radius is not positive, or the motors are on one line as seen
    /// from above.
    pub fn new(
        motors: PerMotor<Point3<f64>>,
        pulley_radii_m: PerMotor<f64>,
    ) -> Result<Self, RigError> {
        for coordinate in motors.iter().flat_map(|m| m.iter()) {
            check("motor coordinate (m)", *coordinate, "a finite number", |_| true)?;
        }
        for radius in pulley_radii_m {
            check("pulley radius (m)", radius, "greater than 0", |r| r > 0.0)?;
        }
        let area_m2 = (motors[1] - motors[0]).cross(&(motors[2] - motors[0])).z.abs() / 2.0;
        if area_m2 < LEAST_AREA_M2 {
            return Err(RigError::Flat { area_m2 });
        }
        Ok(Self { motors, pulley_radii_m })
    }

    /// Returns the paper's rig: A (0.850, 0.610, 0.665), B (0.850, 0, 0.665), C (0, 0.240, 0.665)
    /// m, pulleys of 15 mm radius.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            motors: [
                Point3::new(0.850, 0.610, 0.665),
                Point3::new(0.850, 0.0, 0.665),
                Point3::new(0.0, 0.240, 0.665),
            ],
            pulley_radii_m: [0.015; MOTORS],
        }
    }

    /// Returns the motor points A, B, C; metres, rig frame.
    #[must_use]
    pub fn motors(&self) -> &PerMotor<Point3<f64>> {
        &self.motors
    }

    /// Returns the pulley radii r, metres; order A, B, C.
    #[must_use]
    pub fn pulley_radii_m(&self) -> PerMotor<f64> {
        self.pulley_radii_m
    }

    /// Returns the cable per full step of each motor: 2πr/200, metres; order A, B, C.
    #[must_use]
    pub fn step_lengths_m(&self) -> PerMotor<f64> {
        self.pulley_radii_m.map(|r| std::f64::consts::TAU * r / FULL_STEPS_PER_REVOLUTION)
    }

    /// Returns the lengths of three straight cables from the motors to a ball at `ball` (metres,
    /// rig frame); metres.
    #[must_use]
    pub fn cable_lengths_m(&self, ball: &Point3<f64>) -> PerMotor<f64> {
        self.motors.map(|m| (ball - m).norm())
    }

    /// Returns by how much each cable to a ball at `ball` gets longer while the ball sinks by these
    /// small heights; metres.
    pub(crate) fn lengthening_m(
        &self,
        ball: &Point3<f64>,
        heights_m: PerMotor<f64>,
    ) -> PerMotor<f64> {
        std::array::from_fn(|i| heights_m[i] * (self.motors[i] - ball).normalize().z)
    }

    /// Returns the cable lengths after `motors` full steps (+ pays out) from `start_m`, metres.
    ///
    /// # Errors
    /// [`RigError::NoCable`] if a length would be zero or less.
    pub(crate) fn paid_out_m(
        &self,
        start_m: PerMotor<f64>,
        motors: PerMotor<f64>,
    ) -> Result<PerMotor<f64>, RigError> {
        let steps = self.step_lengths_m();
        let lengths = std::array::from_fn(|i| start_m[i] + steps[i] * motors[i]);
        check_lengths(lengths)?;
        Ok(lengths)
    }

    /// Returns the exact Jacobian J = dp/du, metres of ball per metre of cable, for taut cables:
    /// rows x, y, z; columns A, B, C.
    ///
    /// From l_i² = |p - M_i|² follows diag(l) du = N dp, where row i of N is p - M_i. So J =
    /// N⁻¹ diag(l). Returns `None` if the ball is in the plane of the motors, where J does not
    /// exist.
    #[must_use]
    pub fn jacobian(&self, ball: &Point3<f64>) -> Option<Matrix3<f64>> {
        let rows = self.motors.map(|m| (ball - m).transpose());
        let inverse = Matrix3::from_rows(&rows).try_inverse()?;
        Some(inverse * Matrix3::from_diagonal(&Vector3::from(self.cable_lengths_m(ball))))
    }

    /// Returns the tensions that hold a ball of unit weight at rest at `ball`, order A, B, C:
    /// -J'ẑ (rigid cables). A negative tension means that the cable would have to push. Returns
    /// `None` in the plane of the motors.
    #[must_use]
    pub fn tensions_per_weight(&self, ball: &Point3<f64>) -> Option<PerMotor<f64>> {
        let j = self.jacobian(ball)?;
        Some([-j[(2, 0)], -j[(2, 1)], -j[(2, 2)]])
    }

    /// Returns the barycentric coordinates λ of the ball's projection in the triangle of motors as
    /// seen from above. Inside, all are positive; their sum is 1.
    #[must_use]
    pub fn barycentric(&self, ball: &Point3<f64>) -> PerMotor<f64> {
        let cross = |i: usize, j: usize| (self.motors[i] - ball).cross(&(self.motors[j] - ball)).z;
        let parts = [cross(1, 2), cross(2, 0), cross(0, 1)];
        let sum: f64 = parts.iter().sum();
        parts.map(|part| part / sum)
    }

    /// Checks that the ball can rest at `ball` on three taut cables. Returns their tensions per
    /// weight.
    pub(crate) fn check_hangs(&self, ball: &Point3<f64>) -> Result<PerMotor<f64>, RigError> {
        for coordinate in ball.iter() {
            check("ball coordinate (m)", *coordinate, "a finite number", |_| true)?;
        }
        let tensions = self.tensions_per_weight(ball).unwrap_or([-1.0; MOTORS]);
        match tensions.iter().position(|t| t.is_nan() || *t < 0.0) {
            Some(i) => Err(RigError::CannotHang { motor: NAMES[i], ball_m: (*ball).into() }),
            None => Ok(tensions),
        }
    }
}

/// Checks that all cable lengths are finite and above zero.
pub(crate) fn check_lengths(lengths_m: PerMotor<f64>) -> Result<(), RigError> {
    for (motor, length_m) in NAMES.into_iter().zip(lengths_m) {
        check("cable length (m)", length_m, "a finite number", |_| true)?;
        if length_m <= 0.0 {
            return Err(RigError::NoCable { motor, length_m });
        }
    }
    Ok(())
}

/// Returns the sum of two lengths for each motor.
pub(crate) fn add(one: PerMotor<f64>, other: PerMotor<f64>) -> PerMotor<f64> {
    std::array::from_fn(|i| one[i] + other[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns J = K diag(l) with K from the control notes, for motors at one height.
    fn exact_structure(g: &Geometry, ball: &Point3<f64>) -> Matrix3<f64> {
        let [a, b, c] = g.motors();
        let (d, w, h) = (a.y - b.y, a.x - c.x, a.z - ball.z);
        let t = (c.y - b.y) / d;
        let l = g.barycentric(ball);
        #[rustfmt::skip]
        let k = Matrix3::new(
            -t / w, -(1.0 - t) / w, 1.0 / w,
            -1.0 / d, 1.0 / d, 0.0,
            -l[0] / h, -l[1] / h, -l[2] / h,
        );
        k * Matrix3::from_diagonal(&Vector3::from(g.cable_lengths_m(ball)))
    }

    #[test]
    fn jacobian_has_the_exact_structure() {
        let g = Geometry::paper();
        for ball in [
            Point3::new(0.54, 0.22, 0.459),
            Point3::new(0.4, 0.4, 0.15),
            Point3::new(0.7, 0.3, -0.3),
        ] {
            let j = g.jacobian(&ball).unwrap();
            assert!((j - exact_structure(&g, &ball)).norm() < 1e-12, "at {ball}: {j}");
        }
    }

    #[test]
    fn the_paper_target_is_almost_on_the_edge() {
        let lambda = Geometry::paper().barycentric(&Point3::new(0.4, 0.4, 0.15));
        assert!((lambda[1] - 0.023).abs() < 5e-4, "λ_B is 0.023 by the notes, got {lambda:?}");
        assert!((lambda.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_step_of_the_paper_rig_is_0_471_mm() {
        for step in Geometry::paper().step_lengths_m() {
            assert!((step - 0.471e-3).abs() < 0.5e-6);
        }
    }

    #[test]
    fn static_tensions_balance_the_weight() {
        let (g, ball) = (Geometry::paper(), Point3::new(0.5, 0.25, 0.3));
        let tensions = g.tensions_per_weight(&ball).unwrap();
        let force: Vector3<f64> =
            g.motors().iter().zip(tensions).map(|(m, t)| (m - ball).normalize() * t).sum();
        assert!((force - Vector3::z()).norm() < 1e-12);
    }

    #[test]
    fn invalid_rigs_are_refused() {
        let [a, b, c] = *Geometry::paper().motors();
        let line = Geometry::new([a, b, Point3::new(0.85, 0.3, 1.0)], [0.015; MOTORS]);
        assert!(matches!(line, Err(RigError::Flat { .. })), "{line:?}");
        for radius in [0.0, -0.01, f64::NAN, f64::INFINITY] {
            let rig = Geometry::new([a, b, c], [0.015, radius, 0.015]);
            assert!(matches!(rig, Err(RigError::OutOfRange { .. })), "{rig:?}");
        }
        let nan = Geometry::new([a, b, Point3::new(f64::NAN, 0.3, 1.0)], [0.015; MOTORS]);
        assert!(matches!(nan, Err(RigError::OutOfRange { .. })), "{nan:?}");
        assert!(
            Geometry::paper().jacobian(&Point3::new(0.5, 0.2, 0.665)).is_none(),
            "no J in the motors' plane"
        );
    }
}
