//! The law that estimates J while driving, and uses it where descent is certain enough.

mod estimate;
mod swings;

use super::fixed_point::squared_length;
use super::io::{Law, Limits, Measurement, Setpoint};
use super::rates::MotorRates;
use super::sign;
use estimate::{Estimate, Steps};
use swings::Swings;

/// Of an unsure way the motors do not brake on more than so many steps less, Q8: by then more is
/// known.
const UNSURE_STEPS: i64 = 40 << 8;
/// No setpoint lasts for less: a measurement may come so much later than the one before it, µs.
const VALID_US: i64 = 35_000;
/// The law of signs slows down from here, µm.
const SIGN_SLOWS: i64 = 65_000;

/// Kalman filters for p and J; the step on them that makes E|e|² the least, where |e| falls for
/// every J within three standard deviations; the law of signs elsewhere. Both make V = |e|² fall,
/// so that going from one to the other needs no wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Adaptive {
    limits: Limits,
    estimate: Option<Estimate>,
    swings: Swings,
}

impl Adaptive {
    /// The law for motors of these limits.
    pub(crate) fn new(limits: Limits) -> Self {
        Self { limits, estimate: None, swings: Swings::to([0; 3]) }
    }

    /// Along the `steps`: 9/s of the longest way, less where the motors could not brake in time; of
    /// these rates so much (Q8). They hold until what is left of the way is what the motors brake
    /// on.
    fn along(&self, steps: &Steps, calm: u32) -> Setpoint {
        let n = steps.n;
        let acceleration = i64::from(self.limits.acceleration);
        let longest = n.iter().map(|n| i64::from(n.abs())).max().unwrap_or(0).max(1);
        // Bits: 26 + 8.
        let sure = longest - ((longest * i64::from(steps.unsure)) >> 8).min(UNSURE_STEPS);
        // sqrt(1.25 a m) in Q8, bits: 22 + 1 + 22 + 8.
        let braking = acceleration * 5 / 4 * sure.min(1 << 22) * 256;
        let braking = braking.unsigned_abs().isqrt() as i64;
        // Bits: 31 + 9.
        let rate =
            ((9 * longest).min(braking).min(i64::from(self.limits.rate)) * i64::from(calm)) >> 8;
        // Bits: 26 + 31 is no more than the ratio's 31 after the division.
        let rates = MotorRates(n.map(|n| (i64::from(n) * rate / longest) as i32));
        // m/v - v/2a, bits: 26 + 20 and 31 + 11.
        let valid_us = longest * 1_000_000 / rate.max(1) - rate * 1_953 / acceleration.max(1);
        Setpoint {
            valid_us: valid_us.clamp(VALID_US, u32::MAX.into()) as u32,
            ..Setpoint::at_once(rates)
        }
    }

    /// The law of signs at full speed until close to the target.
    fn by_signs(&self, e: [i32; 3]) -> MotorRates {
        let w = sign::direction(e.map(|e| -e)).map(i64::from);
        let largest = w.iter().map(|w| w.abs()).max().unwrap_or(0).max(1);
        let distance = (squared_length(e).unsigned_abs().isqrt() as i64).min(SIGN_SLOWS);
        // Bits: rate 31 + distance 16 = 47.
        let rate = i64::from(self.limits.rate) * distance / SIGN_SLOWS;
        MotorRates(w.map(|w| (w * rate / largest) as i32))
    }
}

impl Law for Adaptive {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        let estimate = match &mut self.estimate {
            Some(estimate) => {
                estimate.update(measurement);
                *estimate
            }
            none => *none.insert(Estimate::new(measurement)),
        };
        let j = estimate.projected();
        let e = estimate.ahead(&j, measurement);
        let calm = self.swings.calm(measurement.target, e);
        let steps = estimate.steps(&j, e);
        steps.map_or_else(|| Setpoint::at_once(self.by_signs(e)), |steps| self.along(&steps, calm))
    }
}

#[cfg(test)]
mod tests;
