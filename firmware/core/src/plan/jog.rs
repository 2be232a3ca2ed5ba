//! Jog: turns one motor by an exact number of steps, for commissioning.

use super::planner::Planner;
use super::pulses::UNIT;
use crate::law::MotorRates;

/// A jog under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Jogging {
    motor: usize,
    /// End position, Q4 steps.
    end: i32,
    /// Highest rate, Q8 steps/s.
    rate: i32,
}

impl Jogging {
    /// Creates a jog of `motor` (0..3) to `end` (Q4 steps, within its travel) at `rate` (Q8
    /// steps/s, above 0) at most.
    pub fn new(motor: usize, end: i32, rate: i32) -> Self {
        Self { motor, end, rate }
    }

    /// Returns the rates to go on with; `None` once the motor stands at the end. An end between two
    /// microsteps is rounded down.
    pub fn wanted(&self, planner: &Planner) -> Option<MotorRates> {
        let axis = &planner.axes[self.motor];
        let per_microstep = 16 / planner.microsteps;
        let microsteps = (self.end - axis.position).div_euclid(per_microstep);
        // Distance to the middle of the last microstep, bits: microsteps 29 + units 23. A pulse
        // rate of the same number would get there in one tick.
        let ahead = planner.mean.ahead()[self.motor];
        let distance =
            i64::from(microsteps) * i64::from(UNIT) + i64::from(UNIT / 2 - axis.fraction()) - ahead;
        // A rest below one unit of a rate cannot be driven.
        let per_q8 = i64::from(planner.per_q8());
        if distance.abs() < per_q8 && planner.ramp.rates[self.motor] == 0 {
            return None;
        }
        let pulse_rate = approach(distance.unsigned_abs(), planner.deltas[self.motor]);
        let rate = (i64::from(pulse_rate) / per_q8).min(i64::from(self.rate)) as i32;
        let mut rates = [0; 3];
        rates[self.motor] = rate * distance.signum() as i32;
        Some(MotorRates(rates))
    }
}

/// Returns the highest rate from which a motor can still stop within `distance`, with a change of
/// `delta` a tick: the root v of v²/(2 delta) + 3v/2 = distance, or the distance itself where it
/// is less than `delta`.
fn approach(distance: u64, delta: u32) -> u32 {
    let delta = u64::from(delta);
    if distance <= delta {
        return distance as u32;
    }
    // Bits: distance 52, delta 24. Where the product saturates, the rate's limit applies anyway.
    let margin = delta + delta / 2;
    let root = (2 * delta).saturating_mul(distance).saturating_add(margin * margin).isqrt();
    root.saturating_sub(margin).clamp(delta.min(u64::from(u32::MAX >> 1)), u64::from(u32::MAX >> 1))
        as u32
}
