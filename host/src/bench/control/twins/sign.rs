//! The law of signs: u̇ = -g(e) Σ⁻¹ e.

use nalgebra::Vector3;
use plumb_core::law::{Demand, Law, Picture};

use super::{Seen, demand};
use crate::rig::NOMINAL_STEP_M;

/// g(e) is between so many times the nominal one, which it is at [`NOMINAL_MM`].
const FIRMNESS: (f64, f64) = (1.1875, 1.25);
const NOMINAL_MM: f64 = 20.0;
/// Going past the target by less is noise.
const PAST_MM: f64 = 7.0;
/// What is left of the gain after each time, and at least.
const CUT: f64 = 0.875;
const CALMEST: f64 = 0.6875;

/// The gain, and what it has learnt from going past the target.
pub(super) struct Sign {
    /// g/(4s), steps/s for a millimetre.
    gain: f64,
    calm: f64,
    /// The error on the side of the target that the ball was on last, mm.
    side: Vector3<f64>,
}

impl Sign {
    /// g in 1/s for a cable of [`NOMINAL_STEP_M`] a step.
    pub(super) fn new(gain: f64) -> Self {
        Self { gain: gain * 1e-3 / (4.0 * NOMINAL_STEP_M), calm: 1.0, side: Vector3::zeros() }
    }
}

/// -4Σ⁻¹e: the direction in which the motors turn.
pub(super) fn direction(e: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(e.x + 2.0 * e.y + e.z, e.x - 2.0 * e.y + e.z, 2.0 * (e.z - e.x))
}

impl Law for Sign {
    fn update(&mut self, picture: &Picture) -> Demand {
        let seen = Seen::from(picture);
        let e = seen.ball - seen.target;
        let (distance, along) = (e.norm(), e.dot(&self.side));
        if along < 0.0 && distance > PAST_MM {
            self.calm = (self.calm * CUT).max(CALMEST);
        }
        if along <= 0.0 && distance > PAST_MM {
            self.side = e;
        }
        let firmness = (distance / NOMINAL_MM).clamp(FIRMNESS.0, FIRMNESS.1);
        demand(direction(&e) * (self.gain * firmness * self.calm))
    }
}
