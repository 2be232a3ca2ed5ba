//! The law `sign`: u̇ = -g Σ⁻¹ e.

use nalgebra::Vector3;
use plumb_core::law::{Law, Measurement, Setpoint};

use crate::control::float::{FloatMeasurement, setpoint};
use plumb_runtime::rig::NOMINAL_STEP_M;

/// Least error that counts as an overshoot, mm. Smaller errors are noise.
const MIN_OVERSHOOT_MM: f64 = 7.0;
/// Factor of the gain after each overshoot.
const DAMPING: f64 = 205.0 / 256.0;
/// Least gain after overshoots, as a fraction of the configured one.
const MIN_GAIN_SCALE: f64 = 0.1;
/// Distance above which the gain may grow, mm.
const BOOST_FROM_MM: f64 = 12.0;
/// Distance below which the gain may grow, mm.
const BOOST_TO_MM: f64 = 80.0;
/// Growth of the gain with each frame.
const BOOST_GROWTH: f64 = 264.0 / 256.0;
/// Greatest growth of the gain.
const MAX_BOOST: f64 = 2.0;

/// Gain of the law and its adaptation during a drive to a target.
pub(super) struct Sign {
    /// g/(4s), steps/s for a millimetre, where s is the cable length of a step.
    gain: f64,
    /// Factor of the gain after overshoots.
    gain_scale: f64,
    /// Factor of the gain while the ball approaches steadily.
    boost: f64,
    target: Vector3<f64>,
    /// Error at the last sign change outside the noise, mm.
    side: Vector3<f64>,
}

impl Sign {
    /// Creates the law from g (1/s for a cable of [`NOMINAL_STEP_M`] a step).
    pub(super) fn new(gain: f64) -> Self {
        let (target, side) = (Vector3::zeros(), Vector3::zeros());
        Self {
            gain: gain * 1e-3 / (4.0 * NOMINAL_STEP_M),
            gain_scale: 1.0,
            boost: 1.0,
            target,
            side,
        }
    }
}

/// Returns -4Σ⁻¹e, the direction of the motor rates.
pub(super) fn direction(e: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(e.x + 2.0 * e.y + e.z, e.x - 2.0 * e.y + e.z, 2.0 * (e.z - e.x))
}

impl Law for Sign {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        let measurement = FloatMeasurement::from(measurement);
        if self.target != measurement.target {
            (self.gain_scale, self.boost, self.side) = (1.0, 1.0, Vector3::zeros());
            self.target = measurement.target;
        }
        let e = measurement.ball - measurement.target;
        let (distance, along) = (e.norm(), e.dot(&self.side));
        if along < 0.0 && distance > MIN_OVERSHOOT_MM {
            self.gain_scale = (self.gain_scale * DAMPING).max(MIN_GAIN_SCALE);
            self.boost = (self.boost + 1.0) / 2.0;
        } else if self.gain_scale >= 1.0 && BOOST_FROM_MM < distance && distance < BOOST_TO_MM {
            self.boost = (self.boost * BOOST_GROWTH).min(MAX_BOOST);
        }
        if along <= 0.0 && distance > MIN_OVERSHOOT_MM {
            self.side = e;
        }
        let boost = if distance > BOOST_FROM_MM { self.boost } else { 1.0 };
        setpoint(direction(&e) * (self.gain * self.gain_scale * boost))
    }
}
