//! Plant model whose ball is always at rest: slow motors and inextensible cables.

use nalgebra::{Matrix3, Point3, Vector3};
use plumb_protocol::{MOTORS, PerMotor};

use super::forward::{Hang, lowest_point};
use super::geometry::{Geometry, add};
use super::interface::{Plant, RigError, check_advance};

/// Singular value of the cables' directions below which a combination of them bears no load.
const RANK_TOLERANCE: f64 = 1e-9;

/// Rig with inextensible cables that cannot push. The ball is always at the lowest point within
/// reach.
#[derive(Debug, Clone, PartialEq)]
pub struct QuasiStatic {
    geometry: Geometry,
    start_lengths_m: PerMotor<f64>,
    /// Cable that has run off.
    run_off_m: PerMotor<f64>,
    hang: Hang,
}

impl QuasiStatic {
    /// Creates a rig with taut cables and the ball at `start` (metres, rig frame), where the motors
    /// are at zero.
    ///
    /// # Errors
    /// [`RigError::CannotHang`] if the cables cannot hold a ball at `start`;
    /// [`RigError::OutOfRange`] if it is off the plane of two motors.
    pub fn new(geometry: Geometry, start: Point3<f64>) -> Result<Self, RigError> {
        geometry.check_hangs(&start)?;
        Self::with_lengths(geometry, geometry.cable_lengths_m(&start))
    }

    /// Creates a rig with these cable lengths (metres; A, B, C) when the motors are at zero. Cables
    /// may be slack.
    ///
    /// # Errors
    /// The errors of [`lowest_point`].
    pub fn with_lengths(geometry: Geometry, lengths_m: PerMotor<f64>) -> Result<Self, RigError> {
        let hang = lowest_point(&geometry, lengths_m)?;
        Ok(Self { geometry, start_lengths_m: lengths_m, run_off_m: [0.0; MOTORS], hang })
    }

    /// Returns the rig's geometry.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }
}

impl Plant for QuasiStatic {
    fn advance(&mut self, dt_s: f64, motors: PerMotor<f64>) -> Result<(), RigError> {
        check_advance(dt_s, motors)?;
        let start = add(self.start_lengths_m, self.run_off_m);
        self.hang = lowest_point(&self.geometry, self.geometry.paid_out_m(start, motors)?)?;
        Ok(())
    }

    fn run_off(&mut self, heights_m: PerMotor<f64>) {
        let more = self.geometry.lengthening_m(&self.hang.ball, heights_m);
        self.run_off_m = add(self.run_off_m, more);
    }

    fn hang_again(&mut self) {
        self.run_off_m = [0.0; MOTORS];
    }

    fn ball(&self) -> Point3<f64> {
        self.hang.ball
    }

    fn slack(&self) -> PerMotor<bool> {
        self.hang.slack
    }

    fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        let Hang { ball, slack } = self.hang;
        let motors = self.geometry.motors();
        // Columns: directions of the taut cables. The solution is 0 for the zero columns.
        let directions: PerMotor<_> =
            std::array::from_fn(|i| match slack[i] || i >= self.geometry.count() {
                true => Vector3::zeros(),
                false => (motors[i] - ball).normalize(),
            });
        let svd = Matrix3::from_columns(&directions).svd(true, true);
        svd.solve(&Vector3::z(), RANK_TOLERANCE).ok().map(Into::into)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::planar_rig;

    #[test]
    fn paying_out_lowers_the_ball_by_the_jacobian() {
        let (g, start) = (Geometry::paper(), Point3::new(0.54, 0.22, 0.459));
        let mut rig = QuasiStatic::new(g, start).unwrap();
        assert!((rig.ball() - start).norm() < 1e-12);
        rig.advance(0.01, [1.0, 0.5, -0.25]).unwrap();
        let du = nalgebra::Vector3::new(1.0, 0.5, -0.25) * g.step_lengths_m()[0];
        let expected = g.jacobian(&start).unwrap() * du;
        assert!(
            (rig.ball() - start - expected).norm() < 2e-6,
            "{} for {expected}",
            rig.ball() - start
        );
        rig.advance(0.01, [0.0; MOTORS]).unwrap();
        assert!((rig.ball() - start).norm() < 1e-12, "steps are counted from the start");
    }

    #[test]
    fn the_tensions_balance_the_weight_with_slack_cables_too() {
        let (g, start) = (Geometry::paper(), Point3::new(0.54, 0.22, 0.459));
        let mut rig = QuasiStatic::new(g, start).unwrap();
        let mut numbers = Vec::new();
        for motors in [[0.0; MOTORS], [900.0, 0.0, 0.0], [900.0, 0.0, 900.0]] {
            rig.advance(0.01, motors).unwrap();
            let tensions = rig.tensions_per_weight().unwrap();
            let force: Vector3<f64> =
                (0..MOTORS).map(|i| (g.motors()[i] - rig.ball()).normalize() * tensions[i]).sum();
            assert!((force - Vector3::z()).norm() < 1e-6, "{tensions:?} for {motors:?}");
            for (slack, tension) in rig.slack().into_iter().zip(tensions) {
                assert_eq!(slack, tension.abs() < 1e-9, "{tensions:?} for {motors:?}");
            }
            numbers.push(rig.slack().into_iter().filter(|slack| *slack).count());
        }
        assert_eq!(numbers, [0, 1, 2], "cables that are slack");
    }

    #[test]
    fn two_cables_hold_the_ball_in_their_plane() {
        let (g, start) = (planar_rig(), Point3::new(0.0, 0.3, 0.7));
        let mut rig = QuasiStatic::new(g, start).unwrap();
        let per_weight = g.tensions_per_weight(&start).unwrap();
        for third in [0.0, 1e6, -1e6] {
            rig.advance(0.01, [0.0, 0.0, third]).unwrap();
            assert!((rig.ball() - start).norm() < 1e-12, "the third motor has no effect");
            assert_eq!(rig.slack(), [false; MOTORS]);
            let tensions = rig.tensions_per_weight().unwrap();
            assert!((0..2).all(|i| (tensions[i] - per_weight[i]).abs() < 1e-12), "{tensions:?}");
            assert_eq!(tensions[2], 0.0);
        }
        rig.advance(0.01, [3000.0, 0.0, 0.0]).unwrap();
        assert_eq!(rig.slack(), [true, false, false], "A is paid out far");
        assert!((rig.tensions_per_weight().unwrap()[1] - 1.0).abs() < 1e-12);
        let off = QuasiStatic::new(g, Point3::new(0.01, 0.3, 0.7));
        assert!(matches!(off, Err(RigError::OutOfRange { .. })), "{off:?}");
    }

    #[test]
    fn a_refused_step_leaves_the_ball_where_it_was() {
        let mut rig = QuasiStatic::new(Geometry::paper(), Point3::new(0.54, 0.22, 0.459)).unwrap();
        let before = rig.clone();
        assert!(matches!(
            rig.advance(0.01, [-2000.0, 0.0, 0.0]),
            Err(RigError::NoCable { motor: 'A', .. })
        ));
        assert!(matches!(rig.advance(0.01, [-700.0, -400.0, 0.0]), Err(RigError::TooShort { .. })));
        assert!(matches!(rig.advance(f64::NAN, [0.0; MOTORS]), Err(RigError::OutOfRange { .. })));
        assert!(matches!(
            rig.advance(0.01, [0.0, f64::INFINITY, 0.0]),
            Err(RigError::OutOfRange { .. })
        ));
        assert_eq!(rig, before);
    }

    #[test]
    fn a_start_outside_the_triangle_is_refused() {
        for (start, motor) in [(Point3::new(0.9, 0.3, 0.2), 'C'), (Point3::new(0.5, 0.2, 0.9), 'A')]
        {
            let err = QuasiStatic::new(Geometry::paper(), start).unwrap_err();
            assert!(matches!(err, RigError::CannotHang { motor: m, .. } if m == motor), "{err}");
        }
    }
}
