//! The law `adaptive`: estimates J while driving, and uses it where descent is certain enough. Its
//! gain falls where the ball overshoots a target again and again.

mod axis_kalman;
mod estimate;
mod fixed_point;
#[cfg(test)]
mod tests;

use plumb_protocol::prior::JacobianPrior;

use super::io::{Law, Measurement, MotorLimits, MotorRates, Setpoint};
use super::sign::{self, OvershootDetector};
use crate::vector::per_motor;
use estimate::{Estimate, Steps};
use fixed_point::squared_length;

/// Rate over the steps to a target that rests, 1/s.
const GAIN: i64 = 9;
/// Rate over the steps to a target that moves, 1/s: there is nothing to brake for.
const FOLLOWING_GAIN: i64 = 12;
/// Longest part of an unsure distance that braking does not count on, steps in Q8: by then more is
/// known.
const MAX_UNSURE_STEPS: i64 = 40 << 8;
/// Least validity of a setpoint, µs: a measurement may come that much after the last one.
const MIN_VALID_US: i64 = 35_000;
/// Distance below which the sign law slows down, µm.
const SIGN_SLOWDOWN_UM: i64 = 65_000;

/// Kalman filters of p and J. Where |e| falls for every J within three standard deviations, the law
/// takes the step that minimises E|e|²; elsewhere it takes the sign law. Both let V = |e|² fall,
/// so that switching between them needs no wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Adaptive {
    limits: MotorLimits,
    estimate: Option<Estimate>,
    /// What a host knows of J.
    prior: Option<JacobianPrior>,
    damping: OvershootDamping,
}

impl Adaptive {
    /// Creates the law for motors of these limits, with the `prior` of J where there is one.
    pub(crate) fn new(limits: MotorLimits, prior: Option<JacobianPrior>) -> Self {
        Self { limits, estimate: None, prior, damping: OvershootDamping::new([0; 3]) }
    }

    /// Returns rates along the `steps`: `gain` (1/s) times the longest distance, less where the
    /// motors could not brake in time, times `gain_scale` (Q8). They are valid until the distance
    /// that is left is the braking distance.
    fn along(&self, steps: &Steps, gain: i64, gain_scale: u32) -> Setpoint {
        let n = steps.n;
        let acceleration = i64::from(self.limits.acceleration);
        let longest = n.iter().map(|n| i64::from(n.abs())).max().unwrap_or(0).max(1);
        // Bits: 26 + 8.
        let sure = longest - ((longest * i64::from(steps.unsure)) >> 8).min(MAX_UNSURE_STEPS);
        // sqrt(1.25 a m) in Q8, bits: 22 + 1 + 22 + 8.
        let braking = acceleration * 5 / 4 * sure.min(1 << 22) * 256;
        let braking = braking.unsigned_abs().isqrt() as i64;
        let limit = i64::from(self.limits.rate);
        // Bits: 31 + 9.
        let rate = ((gain * longest).min(braking).min(limit) * i64::from(gain_scale)) >> 8;
        // Bits: 26 + 31; after the division at most the 31 of `rate`.
        let rates = MotorRates(n.map(|n| (i64::from(n) * rate / longest) as i32));
        // m/v - v/(2a) in µs, bits: 26 + 20 and 31 + 11. 10^6/(2·256) is 1953.
        let valid_us = longest * 1_000_000 / rate.max(1) - rate * 1_953 / acceleration.max(1);
        Setpoint {
            valid_us: valid_us.clamp(MIN_VALID_US, u32::MAX.into()) as u32,
            ..Setpoint::at_once(rates)
        }
    }

    /// Returns the setpoint with the rates `ahead`, which move the ball as its target moves.
    fn with_feed_forward(&self, setpoint: Setpoint, ahead: MotorRates) -> Setpoint {
        let rates = per_motor(|k| setpoint.rates.0[k].saturating_add(ahead.0[k]));
        Setpoint {
            rates: MotorRates(rates),
            valid_us: u32::MAX,
            room: ahead.room(self.limits.rate),
            ..setpoint
        }
    }

    /// Returns the rates of the sign law for the error `e` (target - position, µm), at full rate
    /// until close to the target.
    fn by_signs(&self, e: [i32; 3]) -> MotorRates {
        let w = sign::direction(e.map(|e| -e), self.limits.is_planar()).map(i64::from);
        let largest = w.iter().map(|w| w.abs()).max().unwrap_or(0).max(1);
        let distance = (squared_length(e).unsigned_abs().isqrt() as i64).min(SIGN_SLOWDOWN_UM);
        // Bits: rate 31 + distance 16 = 47.
        let rate = i64::from(self.limits.rate) * distance / SIGN_SLOWDOWN_UM;
        MotorRates(w.map(|w| (w * rate / largest) as i32))
    }
}

impl Law for Adaptive {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        let is_planar = self.limits.is_planar();
        let estimate = match &mut self.estimate {
            Some(estimate) => {
                estimate.update(measurement);
                *estimate
            }
            none => *none.insert(Estimate::new(measurement, is_planar, self.prior.as_ref())),
        };
        let j = estimate.projected();
        let e = estimate.predicted_error(&j, measurement);
        if measurement.is_moving() {
            self.damping.follow(measurement.target);
        }
        let gain_scale = self.damping.update(measurement.target, e);
        let setpoint = match estimate.steps(&j, e) {
            Some(steps) => {
                let gain = if measurement.is_moving() { FOLLOWING_GAIN } else { GAIN };
                self.along(&steps, gain, gain_scale)
            }
            None => Setpoint::at_once(self.by_signs(e)),
        };
        if measurement.is_moving() {
            let ahead =
                MotorRates(estimate.cautious_steps(&j, measurement.velocity).unwrap_or_default());
            self.with_feed_forward(setpoint, ahead)
        } else {
            setpoint
        }
    }
}

/// Overshoots of a target that do not reduce the gain.
const FREE_OVERSHOOTS: u8 = 1;
/// Factor on the gain at each further overshoot, Q8.
const DAMPING: u32 = 192;
/// Rise of the scale with each measurement while the target moves, Q8: from the least to 1 in 8 s.
const RECOVERY: u32 = 1;
/// Least scale of the gain, Q8.
const MIN_GAIN_SCALE: u32 = 26;

/// Scale of the gain on the way to a target: less after each overshoot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct OvershootDamping {
    target: [i32; 3],
    detector: OvershootDetector,
    overshoots: u8,
    /// Q8.
    gain_scale: u32,
}

impl OvershootDamping {
    /// Creates the damping on the way to `target` (µm).
    fn new(target: [i32; 3]) -> Self {
        Self { target, detector: OvershootDetector::default(), overshoots: 0, gain_scale: 256 }
    }

    /// Goes on with a target that has moved to `target` (µm). Meanwhile the scale rises again.
    fn follow(&mut self, target: [i32; 3]) {
        self.target = target;
        self.gain_scale = (self.gain_scale + RECOVERY).min(256);
    }

    /// Takes the predicted error `e` (µm), and returns the scale of the rates, Q8. Another target
    /// starts afresh.
    fn update(&mut self, target: [i32; 3], e: [i32; 3]) -> u32 {
        if self.target != target {
            *self = Self::new(target);
        }
        if self.detector.overshoots(e, sign::distance(e)) {
            self.overshoots = self.overshoots.saturating_add(1);
            if self.overshoots > FREE_OVERSHOOTS {
                self.gain_scale = ((self.gain_scale * DAMPING) >> 8).max(MIN_GAIN_SCALE);
            }
        }
        self.gain_scale
    }
}
