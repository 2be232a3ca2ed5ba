//! Measurements and setpoints in `f64`, for the baselines.

use nalgebra::Vector3;
use plumb_core::MotorRates;
use plumb_core::law::{Measurement, Setpoint};
use plumb_protocol::{PerAxis, PerMotor};
use plumb_sim::limits::RigLimits;

/// A [`Measurement`] in millimetres and full steps.
pub(super) struct FloatMeasurement {
    /// Ball, mm.
    pub(super) ball: Vector3<f64>,
    /// Motor positions at capture, full steps.
    pub(super) motors: Vector3<f64>,
    /// Motor positions at the end of the planned motion, full steps.
    pub(super) motors_ahead: Vector3<f64>,
    /// Target, mm.
    pub(super) target: Vector3<f64>,
    /// Velocity of the target, mm/s.
    pub(super) velocity: Vector3<f64>,
}

impl From<&Measurement> for FloatMeasurement {
    fn from(measurement: &Measurement) -> Self {
        let millimetres = |p: PerAxis<i32>| Vector3::from(p.map(|c| f64::from(c) * 1e-3));
        let steps = |p: PerMotor<i32>| Vector3::from(p.map(|c| f64::from(c) / 16.0));
        Self {
            ball: millimetres(measurement.ball),
            motors: steps(measurement.motors),
            motors_ahead: steps(measurement.motors_ahead),
            target: millimetres(measurement.target),
            velocity: millimetres(measurement.velocity),
        }
    }
}

/// Returns the immediate setpoint for `rates` (full steps/s), rounded to 1/256 step/s.
pub(super) fn setpoint(rates: Vector3<f64>) -> Setpoint {
    let rates: PerMotor<f64> = rates.into();
    Setpoint::at_once(MotorRates(rates.map(|rate| (rate * 256.0).round() as i32)))
}

/// Rate for a remaining step, 1/s.
const PROPORTIONAL_GAIN: f64 = 8.0;
/// Share of the braking distance's acceleration: a rate of sqrt(2 a n) stops within n steps.
const BRAKING_FACTOR: f64 = 1.2;

/// Returns rates (full steps/s) in the direction of the remaining `steps`: proportional to the
/// longest, limited by the rate from which a motor can brake and by the greatest rate.
pub(super) fn along(steps: Vector3<f64>, limits: &RigLimits) -> Vector3<f64> {
    let longest = steps.amax();
    if longest <= 0.0 {
        return Vector3::zeros();
    }
    let rate = (PROPORTIONAL_GAIN * longest)
        .min((BRAKING_FACTOR * limits.acceleration * longest).sqrt())
        .min(limits.rate);
    steps * (rate / longest)
}

/// Returns the steps in which motors at these `rates` (full steps/s) ramp down to rest.
/// [`Measurement::motors_ahead`] has them, but the rates of a feed-forward go on.
pub(super) fn ramp_down(rates: Vector3<f64>, limits: &RigLimits) -> Vector3<f64> {
    rates.component_mul(&rates.abs()) / (2.0 * limits.acceleration)
}
