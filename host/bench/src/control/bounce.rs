//! A rig whose ball swings about where it would hang: a resonance without a cause, to see what it
//! does to a law.

use nalgebra::{Point3, Vector3};
use plumb_emulator::rig::{Plant, RigError};

use super::kinematic::Kinematic;

/// Sub-steps are at most this long, seconds: 1/150 of a period at 4 Hz.
const SUBSTEP_S: f64 = 1e-3;

/// p̈ = ω²(q - p) - 2ζω ṗ, where q is where the ball of a rigid rig would be.
pub(super) struct Bounce {
    rig: Kinematic,
    omega: f64,
    damping: f64,
    ball: Point3<f64>,
    velocity: Vector3<f64>,
}

impl Bounce {
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
    fn advance(&mut self, dt_s: f64, motors: [f64; 3]) -> Result<(), RigError> {
        self.rig.advance(dt_s, motors)?;
        let parts = (dt_s / SUBSTEP_S).ceil().max(1.0);
        let h = dt_s / parts;
        let mut left = parts;
        while left > 0.0 {
            // Semi-implicit Euler: neutral to energy at this step, and the damping is all that is
            // left.
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

    fn slack(&self) -> [bool; 3] {
        self.rig.slack()
    }
}
