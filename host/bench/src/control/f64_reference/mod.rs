//! The board's laws again, from their equations, in `f64`: what their fixed point costs is the
//! difference.

mod adaptive;
mod interval;
mod sign;

use nalgebra::Vector3;
use plumb_core::MotorRates;
use plumb_core::law::{DeferredLaw, Law, LawSelection, Measurement, Setpoint};
use plumb_core::params::Params;

use adaptive::Adaptive;
use interval::Interval;
use plumb_runtime::rig::LawSettings;
use plumb_sim::limits::Limits;
use sign::Sign;

/// The laws that have a reference; `taut` computes in floating point on the board too.
pub(super) const NAMES: [&str; 3] = ["interval", "sign", "adaptive"];

/// The reference of a law with these parameters, on motors of these limits; the board's own where that
/// is no fixed point.
pub(super) fn of(law: &LawSettings, params: &Params, limits: Limits) -> Box<dyn Law> {
    match law {
        LawSettings::Interval { gamma, alpha, beta, signs, .. } => {
            Box::new(Interval::new(gamma.get(), (alpha.get(), beta.get()), signs))
        }
        LawSettings::Sign { gain, .. } => Box::new(Sign::new(gain.get())),
        LawSettings::Adaptive(_) => Box::new(Adaptive::new(limits)),
        LawSettings::Taut(_) => boards_own(params),
    }
}

/// The law that a board with these parameters has.
pub(super) fn boards_own(params: &Params) -> Box<dyn Law> {
    match params.law() {
        LawSelection::Inline(law) => Box::new(law),
        LawSelection::Deferred(kind) => Box::new(DeferredLaw::new(kind, params.limits())),
    }
}

/// A [`Measurement`] in millimetres and full steps.
pub(super) struct Seen {
    pub(super) ball: Vector3<f64>,
    pub(super) then: Vector3<f64>,
    pub(super) ahead: Vector3<f64>,
    pub(super) target: Vector3<f64>,
}

impl From<&Measurement> for Seen {
    fn from(picture: &Measurement) -> Self {
        let millimetres = |p: [i32; 3]| Vector3::from(p.map(|c| f64::from(c) * 1e-3));
        let steps = |p: [i32; 3]| Vector3::from(p.map(|c| f64::from(c) / 16.0));
        Self {
            ball: millimetres(picture.ball),
            then: steps(picture.motors),
            ahead: steps(picture.motors_ahead),
            target: millimetres(picture.target),
        }
    }
}

/// Rates in full steps/s as the planner takes them, to the nearest 1/256, at once.
pub(super) fn setpoint(rates: Vector3<f64>) -> Setpoint {
    let rates: [f64; 3] = rates.into();
    Setpoint::at_once(MotorRates(rates.map(|rate| (rate * 256.0).round() as i32)))
}

/// Rates along `steps` that are still to go: 8/s of the longest way, no faster than the motor may
/// brake from, or turn.
pub(super) fn along(steps: Vector3<f64>, limits: &Limits) -> Vector3<f64> {
    let longest = steps.amax();
    if longest <= 0.0 {
        return Vector3::zeros();
    }
    let rate = (8.0 * longest).min((1.2 * limits.acceleration * longest).sqrt()).min(limits.rate);
    steps * (rate / longest)
}

#[cfg(test)]
mod tests;
