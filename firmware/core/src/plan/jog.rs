//! Jog: turns one motor by an exact number of steps, for commissioning.

use plumb_protocol::dimension::MOTORS;

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
        let mut rates = [0; MOTORS];
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
    // The root of 64 bits has 32.
    let margin = delta + delta / 2;
    let root = (2 * delta).saturating_mul(distance).saturating_add(margin * margin).isqrt();
    root.saturating_sub(margin).max(delta) as u32
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The rate that is found stops within the distance, and a rate 3 units higher does not.
        #[test]
        fn a_motor_approaches_as_fast_as_it_can_stop(
            delta in 8u32..1 << 24, shift in 0u32..40, distance in 1u64..1 << 52,
        ) {
            let distance = distance >> shift;
            let (rate, delta) = (i128::from(approach(distance, delta)), i128::from(delta));
            let distance = i128::from(distance);
            if distance <= delta {
                prop_assert_eq!(rate, distance);
                return Ok(());
            }
            // v²/(2 delta) + 3v/2 <= distance, times 2 delta.
            let twice = |rate: i128| rate * rate + 3 * delta * rate;
            prop_assert!(rate >= delta);
            prop_assert!(rate == delta || twice(rate) <= 2 * delta * distance + rate);
            let is_largest = 2 * delta * distance > i128::from(u64::MAX);
            prop_assert!(is_largest || twice(rate + 3) > 2 * delta * distance);
        }
    }
}
