//! The divisions of a tick, in 32 bits: the chip divides those in 8 clocks, and 64 bits in hundreds.

use core::hint::black_box;

use super::{CLOCK_HZ, RATE_BITS, TICK_CLOCKS, UNIT};

/// From one pulse to the next at `rate` (above 0, units), clocks, rounded down; beyond a tick it may be more than it is.
pub(super) fn period(rate: u32) -> u32 {
    // UNIT·TICK_CLOCKS = CLOCK_HZ·2^10 = (CLOCK_HZ·2^5)·2^5; the first factor fits 32 bits, and the rest is done by hand.
    const HIGH: u32 = CLOCK_HZ << (RATE_BITS - LOW_BITS);
    const LOW_BITS: u32 = 5;
    const { assert!(HIGH as u64 * 32 == UNIT as u64 * TICK_CLOCKS as u64) };
    let (mut quotient, mut remainder) = (HIGH / rate, HIGH % rate);
    if rate < 1 << (32 - LOW_BITS) {
        return (quotient << LOW_BITS) + (remainder << LOW_BITS) / rate;
    }
    for _ in 0..LOW_BITS {
        // Rates have 31 bits, so twice the remainder has 32.
        (quotient, remainder) = (quotient << 1, remainder << 1);
        if remainder >= rate {
            (quotient, remainder) = (quotient + 1, remainder - rate);
        }
    }
    quotient
}

/// Until `units` are passed at `rate` (units below the rate: within the tick), clocks, rounded down.
pub(super) fn until(units: u32, rate: u32) -> u32 {
    // First with both to 17 bits, whose product with 25 000 has 32: that is right or one too little. (The bound is said
    // again for the compiler: a product that may overflow is checked in 64 bits.)
    let shift = 15u32.saturating_sub(rate.leading_zeros());
    let about = (units >> shift).min(1 << 17) * TICK_CLOCKS / ((rate >> shift) + u32::from(shift > 0));
    // What is left is below twice the rate, so it is right although its two parts overflow.
    let left = units.wrapping_mul(TICK_CLOCKS).wrapping_sub(about.wrapping_mul(rate));
    if left >= rate { about + 1 } else { about }
}

/// `reference` in whole microsteps and what is left of it: [0, UNIT).
pub(super) fn split(reference: i32) -> (i32, i32) {
    // Hidden, since a division by a known number becomes a product of 64 bits.
    let unit = black_box(UNIT.unsigned_abs());
    let magnitude = reference.unsigned_abs();
    let (whole, rest) = ((magnitude / unit) as i32, (magnitude % unit) as i32);
    match (reference < 0, rest) {
        (false, _) => (whole, rest),
        (true, 0) => (-whole, 0),
        (true, _) => (-whole - 1, UNIT - rest),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rates of every magnitude up to 1.25 million microsteps/s.
    fn rates() -> impl Strategy<Value = u32> {
        (0u32..22, 1u32..1_280_000_000).prop_map(|(shift, rate)| (rate >> shift).max(1))
    }

    proptest! {
        #[test]
        fn periods_are_exact(rate in rates()) {
            let exact = UNIT as u64 * u64::from(TICK_CLOCKS) / u64::from(rate);
            prop_assume!(u32::try_from(exact).is_ok());
            prop_assert_eq!(u64::from(period(rate)), exact);
        }

        #[test]
        fn a_moment_is_exact(rate in rates(), part in 0u32..1_000_000) {
            let units = (u64::from(rate) * u64::from(part) / 1_000_000) as u32;
            let exact = u64::from(units) * u64::from(TICK_CLOCKS) / u64::from(rate);
            prop_assert_eq!(u64::from(until(units, rate)), exact);
        }

        #[test]
        fn splitting_is_euclidean(reference in -1_300_000_000i32..1_300_000_000) {
            prop_assert_eq!(split(reference), (reference.div_euclid(UNIT), reference.rem_euclid(UNIT)));
        }
    }
}
