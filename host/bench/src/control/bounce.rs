//! A rig with a resonance between the cables' lowest point and the ball. It shows the effect of a
//! resonance on a law.

use nalgebra::{Point3, Vector3};
use plumb_emulator::plant::{Plant, RigError};
use plumb_protocol::PerMotor;

use super::kinematic::Kinematic;

/// Longest integration step, seconds: 1/250 of a period at 4 Hz.
const SUBSTEP_S: f64 = 1e-3;

/// Second-order response of the ball p to the position q of a rigid rig's ball:
/// p̈ = ω²(q - p) - 2ζω ṗ.
pub(super) struct Bounce {
    rig: Kinematic,
    /// Natural frequency ω, rad/s.
    omega: f64,
    /// 2ζω, 1/s.
    damping: f64,
    ball: Point3<f64>,
    velocity: Vector3<f64>,
}

impl Bounce {
    /// Creates the plant with its ball at rest.
    pub(super) fn new(rig: Kinematic, frequency_hz: f64, damping_ratio: f64) -> Self {
        let omega = std::f64::consts::TAU * frequency_hz;
        Self {
            ball: rig.ball(),
            omega,
            damping: 2.0 * damping_ratio * omega,
            rig,
            velocity: Vector3::zeros(),
        }
    }
}

impl Plant for Bounce {
    fn advance(&mut self, dt_s: f64, motors: PerMotor<f64>) -> Result<(), RigError> {
        self.rig.advance(dt_s, motors)?;
        let parts = (dt_s / SUBSTEP_S).ceil().max(1.0);
        let h = dt_s / parts;
        let mut left = parts;
        while left > 0.0 {
            // Semi-implicit Euler conserves energy at this step, so the model's damping is the only
            // damping.
            let pull = (self.rig.ball() - self.ball) * (self.omega * self.omega);
            self.velocity += (pull - self.velocity * self.damping) * h;
            self.ball += self.velocity * h;
            left -= 1.0;
        }
        Ok(())
    }

    fn ball(&self) -> Point3<f64> {
        self.ball
    }

    fn slack(&self) -> PerMotor<bool> {
        self.rig.slack()
    }
}
