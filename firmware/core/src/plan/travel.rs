//! How far a motor may turn, and whether it can still stop before that.

use super::UNIT;
use crate::wide;

/// For so many ticks a motor that is safe needs not be looked at again.
pub(super) const PATIENCE: u32 = 16;

/// A motor's travel, and where in it nothing is to be feared.
#[derive(Debug, Clone, Copy)]
pub(super) struct Travel {
    /// 1/16 steps.
    limits: (i32, i32),
    /// From in here the motor can stop, also after [`PATIENCE`] ticks more, whatever its rate is on the way to the one that is
    /// wanted; empty where the first is above the second.
    safe: (i32, i32),
}

/// What one pulse is, a motor's position in pulses and units, and how far its reference is ahead of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) position: i32,
    pub(super) fraction: i32,
    pub(super) ahead: i64,
    /// 1/16 steps of a pulse.
    pub(super) per_pulse: i32,
}

impl Travel {
    /// Between these, 1/16 steps.
    pub(super) const fn between(low: i32, high: i32) -> Self {
        Self { limits: (low, high), safe: (i32::MAX, i32::MIN) }
    }

    /// Whether no more is to be looked at where the motor is here.
    pub(super) fn surely(&self, position: i32) -> bool {
        self.safe.0 <= position && position <= self.safe.1
    }

    /// Says that the motor turns at up to `speed` (units, 31 bits), from which it stops in `ticks`, its reference up to
    /// `ahead` pulses ahead of it.
    pub(super) fn expect(&mut self, speed: u32, ticks: u32, ahead: u32, per_pulse: i32) {
        // Where the product has no room, the motor is looked at in every tick.
        const MOST_TICKS: u32 = 1 << 17;
        self.safe = (i32::MAX, i32::MIN);
        if ticks >= MOST_TICKS {
            return;
        }
        // A microstep has 22.3 bits. This tick and a ramp; a pulse for each part that is begun. Bits: 9 + 17, ahead 20, + 4.
        let pulses = ((speed >> 22) + 1).wrapping_mul(ticks + 3 + 2 * PATIENCE) / 2 + ahead + 3;
        let way = pulses.wrapping_mul(per_pulse as u32) as i32;
        self.safe = (self.limits.0 + way, self.limits.1 - way);
    }

    /// Whether the motor stays within its travel if its reference turns at `rate` for this tick and then stops over `ticks`.
    pub(super) fn can_stop(&self, place: &Place, rate: i32, ticks: u32) -> bool {
        // This tick at `rate`, then rate·(1 - k/ticks) for k = 1.. : rate·(ticks + 1)/2 in all. Bits: rate 31, ticks 28.
        let size = (wide::product(rate.unsigned_abs(), ticks.wrapping_add(1)) >> 1) as i64;
        let units = i64::from(place.fraction) + place.ahead + if rate < 0 { -size } else { size };
        // Whole pulses to a limit, 30 bits and the sign, and not from units to pulses, which would be a division.
        let pulses_to = |limit: i32| (limit - place.position) >> place.per_pulse.trailing_zeros();
        let way = |pulses: i32| wide::signed_product(pulses, UNIT);
        match rate.signum() {
            1 => units < way(pulses_to(self.limits.1) + 1),
            // Rounded up: to the first pulse that is not beyond.
            -1 => units >= way(-((place.position - self.limits.0) >> place.per_pulse.trailing_zeros())),
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// By definition, in whole numbers without a limit.
        #[test]
        fn a_motor_stops_where_it_is_said_to(
            limits in (-(1i32 << 30)..=0, 0i32..=1 << 30), off in -3000i32..3000, high: bool, log in 0u32..5,
            rate in -1_280_000_000i32..=1_280_000_000, shift in 0u32..30, ticks in 0u32..1000, fraction in 0..UNIT, ahead in -1_000_000_000i64..1_000_000_000,
        ) {
            let travel = Travel::between(limits.0, limits.1);
            let (rate, per_pulse) = (rate >> shift, 1 << log);
            let units = i128::from(rate) * i128::from(ticks + 1) / 2 + i128::from(fraction) + i128::from(ahead);
            let pulses = units.div_euclid(i128::from(UNIT));
            // Somewhere near to where it makes the difference.
            let edge = i128::from(if high { limits.1 } else { limits.0 }) - pulses * per_pulse + i128::from(off >> log);
            let position = edge.clamp(i128::from(limits.0), i128::from(limits.1)) as i32;
            let end = i128::from(position) + pulses * per_pulse;
            let stops = match rate.signum() {
                1 => end <= i128::from(limits.1),
                -1 => end >= i128::from(limits.0),
                _ => true,
            };
            let place = Place { position, fraction, ahead, per_pulse: per_pulse as i32 };
            prop_assert_eq!(travel.can_stop(&place, rate, ticks), stops);
        }

        /// Where a motor surely can stop, it can.
        #[test]
        fn what_is_sure_is_so(
            high in 0i32..1 << 29, part in 0.0f64..=1.0, shift in 0u32..30, most in 1u32..1_280_000_000, share in -1.0f64..=1.0,
            all_ticks in 1u32..200_000, later in 0..PATIENCE, fraction in 0..UNIT, ahead in 0u32..600_000, ahead_share in -1.0f64..=1.0, log in 0u32..5,
        ) {
            let (speed, per_pulse) = ((most >> shift).max(1), 1 << log);
            let mut travel = Travel::between(-high, high);
            travel.expect(speed, all_ticks, ahead, per_pulse);
            let position = (f64::from(high) * (2.0 * part - 1.0)) as i32;
            prop_assume!(travel.surely(position));
            let rate = (f64::from(speed) * share) as i32;
            let ahead = (f64::from(ahead) * f64::from(UNIT) * ahead_share) as i64;
            // The reference moves on until the motor is looked at the next time.
            let ahead = ahead + i64::from(speed) * i64::from(later) * if share < 0.0 { -1 } else { 1 };
            let place = Place { position, fraction, ahead, per_pulse };
            let ticks = (f64::from(all_ticks) * share.abs()).ceil() as u32;
            prop_assert!(travel.can_stop(&place, rate, ticks));
        }
    }
}
