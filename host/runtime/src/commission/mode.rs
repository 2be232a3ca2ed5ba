//! Slowest motion of a ball on three cables that stretch, from the measured responses.
//!
//! A ball of mass m at p on taut cables of stiffness k follows m p̈ = -k N'N (p - p_rest). The rows
//! of N are the unit vectors of the cables, from motor to ball. A cable's length grows by its
//! vector times the ball's displacement, so that N = s J⁻¹, where J is the displacement for a step
//! and s the cable of a step. The rows of J⁻¹ have the length 1/s: N follows from J without the
//! size of the rig, and in any frame.
//!
//! The slowest period is T = 2π √(m/k) σ, where σ is the largest singular value of N⁻¹. The ball
//! then swings along the singular vector that belongs to σ. Three taut cables leave no other swing:
//! a pendulum that turns about two motors needs a slack cable.

use nalgebra::{Matrix3, Vector3};

use super::fault::Output;

/// Slowest mode, and the motor that moves the ball most along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mode {
    /// Direction of the swing, a unit vector.
    pub(super) direction: Vector3<f64>,
    /// σ: displacement of the ball along the direction for a metre of cable, at least 1.
    pub(super) gain: f64,
    /// Output of the motor.
    pub(super) output: Output,
    /// Displacement of the ball for a step of this motor, metres.
    pub(super) step_m: f64,
}

impl Mode {
    /// Returns the slowest mode for these displacements of the ball for a step of motors A, B, C,
    /// metres; `None` where they lie in a plane.
    pub(super) fn of(per_step: [Vector3<f64>; 3]) -> Option<Self> {
        let mut cables = Matrix3::from_columns(&per_step).try_inverse()?;
        for mut cable in cables.row_iter_mut() {
            let length = cable.norm();
            cable /= length;
        }
        let modes = (cables.transpose() * cables).symmetric_eigen();
        let slowest = modes.eigenvalues.imin();
        let (stiffness, direction) =
            (modes.eigenvalues[slowest], modes.eigenvectors.column(slowest));
        let along = |output: Output| direction.dot(&per_step[output as usize]).abs();
        let output = Output::ALL.into_iter().max_by(|a, b| along(*a).total_cmp(&along(*b)))?;
        let gain = 1.0 / stiffness.sqrt();
        let step_m = per_step[output as usize].norm();
        gain.is_finite().then_some(Self { direction: direction.into(), gain, output, step_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Displacements for a step of cables with these directions from motor to ball.
    fn per_step(cables: [[f64; 3]; 3], step_m: f64) -> [Vector3<f64>; 3] {
        let rows = cables.map(|cable| Vector3::from(cable).normalize().transpose());
        let inverse = Matrix3::from_rows(&rows).try_inverse().unwrap() * step_m;
        [0, 1, 2].map(|motor| inverse.column(motor).into())
    }

    #[test]
    fn steep_cables_swing_aside_and_flat_ones_up_and_down() {
        // Equally spaced about the vertical: λ = 3 cos² up and down, 1.5 sin² aside.
        let around = |slope: f64| {
            [0.0, 120.0, 240.0_f64].map(|degrees| {
                let angle = degrees.to_radians();
                [angle.cos(), angle.sin(), -slope]
            })
        };
        for (slope, is_vertical) in [(5.0_f64, false), (0.1, true)] {
            let mode = Mode::of(per_step(around(slope), 0.0004)).unwrap();
            let sine_squared = 1.0 / (1.0 + slope * slope);
            let least = if is_vertical { 3.0 * (1.0 - sine_squared) } else { 1.5 * sine_squared };
            assert!((mode.gain - least.sqrt().recip()).abs() < 1e-6, "{mode:?}");
            assert_eq!(mode.direction.z.abs() > 0.99, is_vertical, "{mode:?}");
            assert_eq!(mode.direction.z.abs() < 0.01, !is_vertical, "{mode:?}");
        }
    }

    #[test]
    fn the_motor_that_moves_the_ball_most_along_the_mode_is_chosen() {
        let [a, b, c] = per_step([[0.3, 0.3, -1.0], [0.3, -0.2, -1.0], [-0.4, 0.0, -1.0]], 0.0004);
        let mode = Mode::of([a, b, c]).unwrap();
        let other = Mode::of([b, c, a]).unwrap();
        assert!((mode.gain - other.gain).abs() < 1e-9);
        assert_eq!((mode.output as usize + 2) % 3, other.output as usize);
        assert_eq!(Mode::of([a, b, a + b]), None);
    }
}
