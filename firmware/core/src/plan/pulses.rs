//! The planner's output, the units that it counts in, and the divisions of a tick in 32 bits: the
//! chip's divider takes 8 clocks for them, and a division of 64 bits takes hundreds.

use core::hint::black_box;

use plumb_protocol::dimension::PerMotor;

use crate::timing::{CLOCK_HZ, TICK_CLOCKS, TICK_US};

/// Fraction bits of a pulse rate (microsteps/s). With 10 of them, small accelerations still change
/// the rate in a tick.
pub(super) const RATE_BITS: u32 = 10;

/// One microstep in units of the reference, 23 bits. A pulse rate moves the reference by itself
/// every tick.
pub(super) const UNIT: i32 = (1_000_000 / TICK_US as i32) << RATE_BITS;

/// Pulses of one motor in a tick: `count` pulses, the k-th `first + k * period` clocks after the
/// tick's start, all before its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pulses {
    /// Level of the direction line: high where the cable is paid out, unless the motor is reversed.
    pub direction: bool,
    /// Number of pulses (microsteps).
    pub count: u16,
    /// Time of the first pulse, clocks after the tick's start.
    pub first: u32,
    /// Time from one pulse to the next, clocks; at most a tick.
    pub period: u32,
}

impl Pulses {
    /// No pulses.
    pub(super) const NONE: Self = Self { direction: false, count: 0, first: 0, period: 0 };
}

/// Pulses of the three motors in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StepPlan {
    /// Motors A, B and C.
    pub motors: PerMotor<Pulses>,
}

/// A quotient rounded down, and the remainder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Quotient {
    pub(super) whole: u32,
    pub(super) rest: u32,
}

impl Quotient {
    /// Returns the quotient that subtracts this one when it is added to another of the same
    /// divisor; wraps.
    pub(super) fn negative(self, divisor: u32) -> Self {
        match self.rest {
            0 => Self { whole: self.whole.wrapping_neg(), rest: 0 },
            rest => Self { whole: !self.whole, rest: divisor - rest },
        }
    }
}

/// Returns the time between pulses at `rate` (31 bits, at least 64 units), clocks, rounded down.
pub(super) fn period(rate: u32) -> u32 {
    // UNIT·TICK_CLOCKS = CLOCK_HZ·2^10. As many of the 10 bits as fit 32 bits with CLOCK_HZ are in
    // the first factor; the other ones follow one by one.
    const HIGH: u32 = CLOCK_HZ << (RATE_BITS - LOW_BITS);
    const LOW_BITS: u32 = RATE_BITS - CLOCK_HZ.leading_zeros();
    const { assert!((HIGH as u64) << LOW_BITS == UNIT as u64 * TICK_CLOCKS as u64) };
    let (mut whole, mut rest) = (HIGH / rate, HIGH % rate);
    if rate < 1 << (32 - LOW_BITS) {
        return (whole << LOW_BITS) + (rest << LOW_BITS) / rate;
    }
    for _ in 0..LOW_BITS {
        // Rates have 31 bits, so twice the remainder has 32.
        (whole, rest) = (whole << 1, rest << 1);
        if rest >= rate {
            (whole, rest) = (whole + 1, rest - rate);
        }
    }
    whole
}

/// Returns the time in which `units` (up to a microstep) are passed at `rate`, clocks. Where the
/// time exceeds a tick (`units` above `rate`), `rate` must be 64 units at least.
pub(super) fn until(units: u32, rate: u32) -> Quotient {
    if units > rate {
        // Whole ticks first, then the rest of the last one.
        let (ticks, units) = (units / rate, units % rate);
        let Quotient { whole, rest } = within(units, rate);
        return Quotient { whole: ticks.wrapping_mul(TICK_CLOCKS).wrapping_add(whole), rest };
    }
    within(units, rate)
}

/// Returns the same for `units` up to `rate`.
fn within(units: u32, rate: u32) -> Quotient {
    // The first guess has both numbers to 17 bits, the rate to 16 at least: it is too small by at
    // most 2·TICK_CLOCKS/2^16, which is less than one, and the product has 32 bits. (`min` repeats
    // the bound for the compiler, which would check a product that may overflow in 64 bits.)
    const { assert!(TICK_CLOCKS < 1 << 15) };
    let shift = 15u32.saturating_sub(rate.leading_zeros());
    let about =
        (units >> shift).min(1 << 17) * TICK_CLOCKS / ((rate >> shift) + u32::from(shift > 0));
    // The remainder is below twice the rate, so it is right although its two terms overflow.
    let left = units.wrapping_mul(TICK_CLOCKS).wrapping_sub(about.wrapping_mul(rate));
    if left >= rate {
        Quotient { whole: about + 1, rest: left - rate }
    } else {
        Quotient { whole: about, rest: left }
    }
}

/// Splits `units` into whole microsteps and the rest.
pub(super) fn split(units: u32) -> (u32, u32) {
    // Hidden from the compiler, which would make a product of 64 bits of a division by a constant.
    let unit = black_box(UNIT.unsigned_abs());
    (units / unit, units % unit)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Rates of every magnitude up to 1.25 million microsteps/s.
    fn rates() -> impl Strategy<Value = u32> {
        (0u32..22, 1u32..1_280_000_000).prop_map(|(shift, rate)| (rate >> shift).max(1))
    }

    /// The quotient, exactly.
    fn exact(dividend: u64, rate: u32) -> Quotient {
        let rate = u64::from(rate);
        Quotient { whole: (dividend / rate) as u32, rest: (dividend % rate) as u32 }
    }

    proptest! {
        #[test]
        fn periods_are_exact(rate in rates()) {
            let dividend = UNIT as u64 * u64::from(TICK_CLOCKS);
            prop_assume!(rate >= 64);
            prop_assert_eq!(period(rate), exact(dividend, rate).whole);
        }

        #[test]
        fn a_moment_is_exact(rate in rates(), part in 0u32..=1_000_000) {
            let within = (u64::from(rate) * u64::from(part) / 1_000_000) as u32;
            let clocks = u64::from(within) * u64::from(TICK_CLOCKS);
            prop_assert_eq!(until(within, rate), exact(clocks, rate));
            prop_assume!(rate >= 64);
            let any = (UNIT as u64 * u64::from(part) / 1_000_000) as u32;
            prop_assert_eq!(until(any, rate), exact(u64::from(any) * u64::from(TICK_CLOCKS), rate));
        }

        #[test]
        fn splitting_is_exact(units in 0u32..1_300_000_000) {
            prop_assert_eq!(split(units), (units / UNIT as u32, units % UNIT as u32));
        }
    }
}
