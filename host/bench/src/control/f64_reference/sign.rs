//! The law of signs: u̇ = -g Σ⁻¹ e.

use nalgebra::Vector3;
use plumb_core::law::{Law, Measurement, Setpoint};

use super::{Seen, setpoint};
use plumb_runtime::rig::NOMINAL_STEP_M;

/// Going past the target by less is noise.
const PAST_MM: f64 = 7.0;
/// What is left of the gain after each time, and at least.
const CUT: f64 = 205.0 / 256.0;
const CALMEST: f64 = 0.1;
/// The gain grows between these distances, by so much with each picture, up to so much.
const GROWS_MM: (f64, f64) = (12.0, 80.0);
const GROWTH: f64 = 264.0 / 256.0;
const BOLDEST: f64 = 2.0;

/// The gain, and what it has learnt on the way to a target.
pub(super) struct Sign {
    /// g/(4s), steps/s for a millimetre.
    gain: f64,
    calm: f64,
    bold: f64,
    target: Vector3<f64>,
    /// The error on the side of the target that the ball was on last, mm.
    side: Vector3<f64>,
}

impl Sign {
    /// g in 1/s for a cable of [`NOMINAL_STEP_M`] a step.
    pub(super) fn new(gain: f64) -> Self {
        let (target, side) = (Vector3::zeros(), Vector3::zeros());
        Self { gain: gain * 1e-3 / (4.0 * NOMINAL_STEP_M), calm: 1.0, bold: 1.0, target, side }
    }
}

/// -4Σ⁻¹e: the direction in which the motors turn.
pub(super) fn direction(e: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(e.x + 2.0 * e.y + e.z, e.x - 2.0 * e.y + e.z, 2.0 * (e.z - e.x))
}

impl Law for Sign {
    fn update(&mut self, picture: &Measurement) -> Setpoint {
        let seen = Seen::from(picture);
        if self.target != seen.target {
            (self.calm, self.bold, self.side) = (1.0, 1.0, Vector3::zeros());
            self.target = seen.target;
        }
        let e = seen.ball - seen.target;
        let (distance, along) = (e.norm(), e.dot(&self.side));
        if along < 0.0 && distance > PAST_MM {
            self.calm = (self.calm * CUT).max(CALMEST);
            self.bold = (self.bold + 1.0) / 2.0;
        } else if self.calm >= 1.0 && GROWS_MM.0 < distance && distance < GROWS_MM.1 {
            self.bold = (self.bold * GROWTH).min(BOLDEST);
        }
        if along <= 0.0 && distance > PAST_MM {
            self.side = e;
        }
        let bold = if distance > GROWS_MM.0 { self.bold } else { 1.0 };
        setpoint(direction(&e) * (self.gain * self.calm * bold))
    }
}
