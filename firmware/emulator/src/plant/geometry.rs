//! Positions of the motors, cable per step, and the exact kinematics.

use nalgebra::{Matrix3, Point3, Vector3};
use plumb_protocol::{MOTORS, PerMotor};

use super::interface::{NAMES, RigError, check};

/// Full steps per revolution of a common stepper motor (1.8 degrees per step).
pub const FULL_STEPS_PER_REVOLUTION: f64 = 200.0;

/// Smallest area of the triangle of motors as seen from above, m².
const LEAST_AREA_M2: f64 = 1e-6;

/// Smallest horizontal distance of two motors in a plane, metres.
const LEAST_APART_M: f64 = 1e-3;

/// Three motors in space or two in a plane, and their pulleys. In this model, the cables leave from
/// the motor points for every pulley radius.
///
/// With two motors, motor C is absent: it has no cable, and the values of motor B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry {
    /// Number of motors, 2 or 3.
    count: usize,
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
        let rig = Self { count: MOTORS, motors, pulley_radii_m }.checked()?;
        let area_m2 = (motors[1] - motors[0]).cross(&(motors[2] - motors[0])).z.abs() / 2.0;
        if area_m2 < LEAST_AREA_M2 {
            return Err(RigError::Flat { area_m2 });
        }
        Ok(rig)
    }

    /// Creates a rig in the plane x = 0 with its motors A, B at these points (metres, rig frame;
    /// A usually at larger y) and pulleys of these radii (metres, > 0).
    ///
    /// # Errors
    /// If a number is not finite, a radius is not positive, a motor is off the plane, or the motors
    /// are horizontally nearer than 1 mm.
    pub fn planar(
        [a, b]: [Point3<f64>; 2],
        [radius_a, radius_b]: [f64; 2],
    ) -> Result<Self, RigError> {
        let pulley_radii_m = [radius_a, radius_b, radius_b];
        let rig = Self { count: 2, motors: [a, b, b], pulley_radii_m }.checked()?;
        let apart_m = (a.y - b.y).abs();
        if apart_m < LEAST_APART_M {
            return Err(RigError::AboveOneAnother { apart_m });
        }
        Ok(rig)
    }

    /// Returns the rig if its motor points and pulley radii are in their ranges.
    fn checked(self) -> Result<Self, RigError> {
        for motor in &self.motors {
            self.check_point("motor coordinate (m)", motor)?;
        }
        for radius in self.pulley_radii_m {
            check("pulley radius (m)", radius, "greater than 0", |r| r > 0.0)?;
        }
        Ok(self)
    }

    /// Checks that a point of the rig is finite, and in the plane of two motors.
    fn check_point(&self, name: &'static str, point: &Point3<f64>) -> Result<(), RigError> {
        for coordinate in point.iter() {
            check(name, *coordinate, "a finite number", |_| true)?;
        }
        if self.count < MOTORS {
            check("x on a rig with two motors (m)", point.x, "0", |x| x == 0.0)?;
        }
        Ok(())
    }

    /// Returns the paper's rig: A (0.850, 0.610, 0.665), B (0.850, 0, 0.665), C (0, 0.240, 0.665)
    /// m, pulleys of 15 mm radius.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            count: MOTORS,
            motors: [
                Point3::new(0.850, 0.610, 0.665),
                Point3::new(0.850, 0.0, 0.665),
                Point3::new(0.0, 0.240, 0.665),
            ],
            pulley_radii_m: [0.015; MOTORS],
        }
    }

    /// Returns the number of motors: 3, or 2 in a plane, where motor C is absent.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
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

    /// Returns the vectors from the motors to a ball at `ball`, metres. That of an absent motor is
    /// x̂: a cable from far away, which keeps the ball in the plane.
    fn cables(&self, ball: &Point3<f64>) -> PerMotor<Vector3<f64>> {
        let cable = |i| if i < self.count { ball - self.motors[i] } else { Vector3::x() };
        std::array::from_fn(cable)
    }

    /// Returns the lengths of straight cables from the motors to a ball at `ball` (metres, rig
    /// frame); metres, 0 for an absent motor.
    #[must_use]
    pub fn cable_lengths_m(&self, ball: &Point3<f64>) -> PerMotor<f64> {
        let mut lengths = self.cables(ball).map(|cable| cable.norm());
        lengths[self.count..].fill(0.0);
        lengths
    }

    /// Returns by how much each cable to a ball at `ball` gets longer while the ball sinks by these
    /// small heights; metres.
    pub(crate) fn lengthening_m(
        &self,
        ball: &Point3<f64>,
        heights_m: PerMotor<f64>,
    ) -> PerMotor<f64> {
        let cables = self.cables(ball);
        std::array::from_fn(|i| heights_m[i] * -cables[i].normalize().z)
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
        self.check_lengths(lengths)?;
        Ok(lengths)
    }

    /// Checks that all cable lengths are finite and above zero. That of an absent motor has no
    /// effect.
    pub(crate) fn check_lengths(&self, lengths_m: PerMotor<f64>) -> Result<(), RigError> {
        for (motor, length_m) in NAMES.into_iter().zip(lengths_m).take(self.count) {
            check("cable length (m)", length_m, "a finite number", |_| true)?;
            if length_m <= 0.0 {
                return Err(RigError::NoCable { motor, length_m });
            }
        }
        Ok(())
    }

    /// Returns the exact Jacobian J = dp/du, metres of ball per metre of cable, for taut cables:
    /// rows x, y, z; columns A, B, C. With two motors, row x and column C are 0.
    ///
    /// From l_i² = |p - M_i|² follows diag(l) du = N dp, where row i of N is p - M_i. So J =
    /// N⁻¹ diag(l). Returns `None` if the ball is in the plane of the motors, or in the line of two
    /// motors, where J does not exist.
    #[must_use]
    pub fn jacobian(&self, ball: &Point3<f64>) -> Option<Matrix3<f64>> {
        let rows = self.cables(ball).map(|cable| cable.transpose());
        let inverse = Matrix3::from_rows(&rows).try_inverse()?;
        Some(inverse * Matrix3::from_diagonal(&Vector3::from(self.cable_lengths_m(ball))))
    }

    /// Returns the tensions that hold a ball of unit weight at rest at `ball`, order A, B, C:
    /// -J'ẑ (rigid cables). A negative tension means that the cable would have to push. Returns
    /// `None` where J does not exist.
    #[must_use]
    pub fn tensions_per_weight(&self, ball: &Point3<f64>) -> Option<PerMotor<f64>> {
        let j = self.jacobian(ball)?;
        Some([-j[(2, 0)], -j[(2, 1)], -j[(2, 2)]])
    }

    /// Returns the barycentric coordinates λ of the ball's projection in the triangle of motors as
    /// seen from above, or in the line of two motors: (y - y_B)/D, (y_A - y)/D, 0. Inside, those of
    /// all motors are positive; their sum is 1.
    #[must_use]
    pub fn barycentric(&self, ball: &Point3<f64>) -> PerMotor<f64> {
        let cables = self.cables(ball);
        let cross = |i: usize, j: usize| cables[i].cross(&cables[j]).z;
        let mut parts = [cross(1, 2), cross(2, 0), cross(0, 1)];
        parts[self.count..].fill(0.0);
        let sum: f64 = parts.iter().sum();
        parts.map(|part| part / sum)
    }

    /// Checks that the ball can rest at `ball` on taut cables. Returns their tensions per weight.
    pub(crate) fn check_hangs(&self, ball: &Point3<f64>) -> Result<PerMotor<f64>, RigError> {
        self.check_point("ball coordinate (m)", ball)?;
        let tensions = self.tensions_per_weight(ball).unwrap_or([-1.0; MOTORS]);
        match tensions.iter().position(|t| t.is_nan() || *t < 0.0) {
            Some(i) => Err(RigError::CannotHang { motor: NAMES[i], ball_m: (*ball).into() }),
            None => Ok(tensions),
        }
    }
}

/// Returns the sum of two lengths for each motor.
pub(crate) fn add(one: PerMotor<f64>, other: PerMotor<f64>) -> PerMotor<f64> {
    std::array::from_fn(|i| one[i] + other[i])
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix2;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::plant::{planar_rig, proptest_config};

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

    #[test]
    fn invalid_rigs_in_a_plane_are_refused() {
        let at = |x, y| Point3::new(x, y, 1.0);
        let upright = Geometry::planar([at(0.0, 0.5), Point3::new(0.0, 0.5009, 0.2)], [0.015; 2]);
        assert!(matches!(upright, Err(RigError::AboveOneAnother { .. })), "{upright:?}");
        for (other, radius) in
            [(at(0.1, 0.0), 0.015), (at(0.0, f64::NAN), 0.015), (at(0.0, 0.0), 0.0)]
        {
            let rig = Geometry::planar([at(0.0, 1.0), other], [0.015, radius]);
            assert!(matches!(rig, Err(RigError::OutOfRange { .. })), "{rig:?}");
        }
        let g = planar_rig();
        assert!(g.check_hangs(&at(0.0, 0.5)).is_ok());
        for (y, named) in [(-0.1, 'A'), (1.1, 'B')] {
            let outside = g.check_hangs(&at(0.0, y));
            assert!(matches!(outside, Err(RigError::CannotHang { motor, .. }) if motor == named));
        }
        assert!(matches!(g.check_hangs(&at(0.1, 0.5)), Err(RigError::OutOfRange { .. })));
        assert!(g.jacobian(&Point3::new(0.0, 0.0, 1.1)).is_none(), "no J in the motors' line");
    }

    #[test]
    fn an_absent_motor_has_no_part_in_a_plane() {
        let (g, ball) = (planar_rig(), Point3::new(0.0, 0.3, 0.7));
        assert_eq!((g.count(), Geometry::paper().count()), (2, 3));
        let lengths = Vector3::from(g.cable_lengths_m(&ball));
        assert!((lengths - Vector3::new(0.7f64.hypot(0.5), 0.5, 0.0)).norm() < 1e-12, "{lengths}");
        // A ball that swings out of the plane has the same coordinates.
        let lambda = g.barycentric(&(ball + Vector3::x() * 0.1));
        assert!((lambda[0] - 0.3).abs() < 1e-12 && (lambda[1] - 0.7).abs() < 1e-12);
        assert_eq!((lambda[2], g.tensions_per_weight(&ball).unwrap()[2]), (0.0, 0.0));
        let down = g.lengthening_m(&ball, [1e-6; MOTORS]);
        let lower = ball - Vector3::z() * 1e-6;
        let (before, after) = (g.cable_lengths_m(&ball), g.cable_lengths_m(&lower));
        for i in 0..MOTORS {
            assert!((after[i] - before[i] - down[i]).abs() < 1e-11, "cable {i}: {down:?}");
        }
    }

    /// Returns the smallest eigenvalue of the symmetric part of J Σ⁻¹ for two cables of these
    /// lengths (m) at these angles to the vertical (rad); rows y, z.
    fn least_gain(angles: [f64; 2], lengths: [f64; 2]) -> f64 {
        let at = |i: usize| {
            let (sin, cos) = angles[i].sin_cos();
            Point3::new(0.0, [sin, -sin][i] * lengths[i], cos * lengths[i])
        };
        let j = Geometry::planar([at(0), at(1)], [0.015; 2])
            .unwrap()
            .jacobian(&Point3::origin())
            .unwrap();
        let product = j.fixed_view::<2, 2>(1, 0) * Matrix2::new(-0.5, -0.5, 0.5, -0.5);
        ((product + product.transpose()) * 0.5).symmetric_eigenvalues().min()
    }

    #[test]
    fn the_least_gain_of_the_sign_law_in_a_plane_is_0_4704() {
        let angle = |k: u32| f64::from(k) / 500.0 * FRAC_PI_2;
        let grid = (1..500).flat_map(|a| (1..500).map(move |b| [angle(a), angle(b)]));
        let least = grid.map(|angles| least_gain(angles, [1.0; 2])).fold(f64::INFINITY, f64::min);
        assert!((0.4704..0.4720).contains(&least), "{least}");
    }

    proptest! {
        #![proptest_config(proptest_config())]

        /// Checks the theorem of the sign law with two motors: its gain has a lower bound over all
        /// rigs and poses, and a closed form.
        #[test]
        fn the_sign_law_in_a_plane_has_a_least_gain(
            angles in prop::array::uniform2(0.02..1.55f64),
            lengths in prop::array::uniform2(0.05..2.0f64),
        ) {
            let (mean, half) = ((angles[0] + angles[1]) / 2.0, (angles[1] - angles[0]) / 2.0);
            let (sin, cos) = mean.sin_cos();
            let least = half.cos() * (cos + sin) - (cos - sin).abs();
            let closed = least / (2.0 * (2.0 * mean).sin());
            let gain = least_gain(angles, lengths);
            prop_assert!((gain - closed).abs() < 1e-9 * (1.0 + closed), "{gain} for {closed}");
            prop_assert!(gain >= 0.4704, "{gain} at {angles:?}");
        }
    }
}
