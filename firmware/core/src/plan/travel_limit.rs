//! Travel limits of a motor, and whether it can still stop within them.

use plumb_protocol::config::Motor;

use super::pulses::UNIT;
use crate::params::MAX_TRAVEL;
use crate::wide;

/// Ticks for which a motor in its safe zone needs no further check.
pub(super) const SAFE_TICKS: u32 = 16;

/// Travel of one motor, and the zone in it that needs no check.
#[derive(Debug, Clone, Copy)]
pub(super) struct TravelLimit {
    /// Lowest and highest position, Q4 steps.
    limits: (i32, i32),
    /// Safe zone, Q4 steps: from a position in it the motor can stop, also after [`SAFE_TICKS`]
    /// ticks more, at any rate on the way to the wanted one. Empty where the first bound is above
    /// the second.
    safe: (i32, i32),
}

/// Position of a motor, and how far it still follows its reference.
#[derive(Debug, Clone, Copy)]
pub(super) struct MotorPosition {
    /// Position by the pulses given, Q4 steps.
    pub(super) position: i32,
    /// Position beyond the last pulse, units.
    pub(super) fraction: i32,
    /// Movement that follows if the reference stands still, units.
    pub(super) ahead: i64,
    /// Q4 steps of a pulse: 1, 2, 4, 8 or 16.
    pub(super) per_pulse: i32,
}

/// A ramp to rest that all motors take together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stop {
    /// Ticks of the ramp.
    ticks: u32,
    /// What rounding adds to the distance of each motor at most, units.
    rounding: i64,
}

/// Error of the moving average's rates in a tick at most, units: one for the mean, one for the
/// interpolation towards it.
const MEAN_ROUNDING: u32 = 2;

/// Longest ramp for which a safe zone is computed, ticks. Beyond it the product has no room, and
/// the motor is checked in every tick.
pub(super) const MAX_SAFE_ZONE_TICKS: u32 = 1 << 17;

impl TravelLimit {
    /// Creates the travel of `motor` about `zero` (Q4 steps, within ±[`MAX_TRAVEL`]), without a
    /// safe zone. Limits beyond ±[`MAX_TRAVEL`] from the start, which leave no room for a stop in
    /// an i32, become that.
    pub(super) fn about(zero: i32, motor: &Motor) -> Self {
        let limit = |of_zero: i32| (zero + of_zero).clamp(-MAX_TRAVEL, MAX_TRAVEL);
        Self::between(limit(motor.travel_min.0), limit(motor.travel_max.0))
    }

    /// Creates a travel between two positions, Q4 steps, without a safe zone.
    pub(super) const fn between(low: i32, high: i32) -> Self {
        Self { limits: (low, high), safe: (i32::MAX, i32::MIN) }
    }

    /// Returns whether a motor at `position` needs no check.
    pub(super) fn in_safe_zone(&self, position: i32) -> bool {
        self.safe.0 <= position && position <= self.safe.1
    }

    /// Computes the safe zone of a motor that turns at up to `speed` (units, 31 bits), from which
    /// it stops in `ticks`, and that is up to `ahead` pulses behind its reference.
    pub(super) fn set_safe_zone(&mut self, speed: u32, ticks: u32, ahead: u32, per_pulse: i32) {
        self.safe = (i32::MAX, i32::MIN);
        if ticks >= MAX_SAFE_ZONE_TICKS {
            return;
        }
        // This tick and a ramp, with a pulse for each part of one; a microstep has 22.3 bits.
        // Bits: speed 9 + ticks 17, ahead 20; + 4 for `per_pulse`.
        let pulses = ((speed >> 22) + 1).wrapping_mul(ticks + 3 + 2 * SAFE_TICKS) / 2 + ahead + 3;
        let distance = pulses.wrapping_mul(per_pulse as u32) as i32;
        self.safe = (self.limits.0 + distance, self.limits.1 - distance);
    }

    /// Returns whether the motor stays within its travel if its reference turns at `rate` (units)
    /// for this tick and then comes to rest by `stop`.
    pub(super) fn can_stop(&self, motor: &MotorPosition, rate: i32, stop: &Stop) -> bool {
        // This tick at `rate`, then rate·(1 - k/ticks) for k = 1.. : rate·(ticks + 1)/2 in all.
        // Bits: rate 31 + ticks 28.
        let line = wide::product(rate.unsigned_abs(), stop.ticks.wrapping_add(1)) >> 1;
        let size = line as i64 + stop.rounding;
        let units = i64::from(motor.fraction) + motor.ahead + if rate < 0 { -size } else { size };
        // Whole pulses to a limit, 30 bits and the sign. Units are not converted to pulses, which
        // would take a division.
        let to_pulses = |distance: i32| distance >> motor.per_pulse.trailing_zeros();
        let to_units = |pulses: i32| wide::signed_product(pulses, UNIT);
        let (low, high) = self.limits;
        match rate.signum() {
            1 => units < to_units(to_pulses(high - motor.position) + 1),
            // Rounded up: to the first pulse that is not beyond the limit.
            -1 => units >= to_units(-to_pulses(motor.position - low)),
            _ => true,
        }
    }
}

impl Stop {
    /// Creates a ramp over `ticks` (28 bits), the fewest that the motors can take. They follow
    /// their references through a moving average within `lag_ticks`; 0 where there is none.
    ///
    /// A ramp from R over n ticks goes through R - floor(R·k/n), k = 1..n, each less than a unit
    /// above the straight line. Without rounding, the sum with the tick before is R·(n + 1)/2. Let
    /// Φ(R, n) = R·(n - 1)/2 + n·(n - 1)/4 be the bound of the ramp alone. After one tick the
    /// rate is R' <= R·(n - 1)/n + (n - 1)/n, and the next ramp takes n - 1 ticks:
    /// R' + Φ(R', n - 1) <= R·(n - 1)/2 + (n - 1)/2 + (n - 1)·(n - 2)/4 = Φ(R, n). So the bound
    /// holds for the ramp, and for every ramp to rest that begins on its way, also where each tick
    /// begins another one.
    pub(super) fn over(ticks: u32, lag_ticks: u32) -> Self {
        let ramps = (wide::product(ticks, ticks.saturating_sub(1)) >> 2) as i64;
        let mean = match lag_ticks {
            0 => 0,
            _ => i64::from(lag_ticks.wrapping_add(ticks).wrapping_mul(MEAN_ROUNDING)),
        };
        // One unit for each of the two halves that are rounded down above.
        Self { ticks, rounding: ramps + mean + 2 }
    }
}

#[cfg(test)]
mod tests {
    use plumb_protocol::units::Steps16;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_travel_never_passes_the_range_of_the_planner() {
        let config = plumb_protocol::Config::example();
        let wide = Motor {
            travel_min: Steps16(-MAX_TRAVEL),
            travel_max: Steps16(MAX_TRAVEL),
            ..config.motors[0]
        };
        for zero in [-MAX_TRAVEL, -5, 0, 5, MAX_TRAVEL] {
            let (low, high) = TravelLimit::about(zero, &wide).limits;
            assert_eq!(
                (low, high),
                ((zero - MAX_TRAVEL).max(-MAX_TRAVEL), (zero + MAX_TRAVEL).min(MAX_TRAVEL))
            );
        }
    }

    /// 1.25 million pulses/s, which at the least acceleration take 160 million ticks to rest.
    #[test]
    fn the_longest_stop_overflows_nowhere() {
        const FASTEST: i32 = 1_280_000_000;
        let travel = TravelLimit::between(-(1 << 29), 1 << 29);
        for lag_ticks in [0, 2032] {
            let stop = Stop::over(FASTEST as u32 / 8, lag_ticks);
            for (rate, position) in [(FASTEST, -(1 << 29)), (-FASTEST, 1 << 29)] {
                let ahead = i64::from(rate) * i64::from(lag_ticks);
                let motor = MotorPosition { position, fraction: UNIT - 1, ahead, per_pulse: 1 };
                assert!(!travel.can_stop(&motor, rate, &stop));
                let slowly = Stop::over(1, lag_ticks);
                assert!(travel.can_stop(
                    &MotorPosition { per_pulse: 16, ..motor },
                    rate.signum(),
                    &slowly
                ));
            }
        }
    }

    /// From an odd rate R, two ticks to rest take (3R + 1)/2 units with the tick before. The bound
    /// is one unit more, and what the moving average rounds.
    #[test]
    fn a_stop_may_end_two_units_before_the_next_pulse() {
        for (rate, lag_ticks) in [1, 77, 4_001].into_iter().flat_map(|r| [(r, 0), (r, 64)]) {
            let way = (3 * rate + 1) / 2 + if lag_ticks > 0 { 2 * (lag_ticks + 2) } else { 0 };
            let stop = Stop::over(2, lag_ticks as u32);
            let can_stop = |position, fraction, rate| {
                let motor = MotorPosition { position, fraction, ahead: 0, per_pulse: 1 };
                TravelLimit::between(-16, 16).can_stop(&motor, rate, &stop)
            };
            assert!(can_stop(16, UNIT - way - 2, rate) && !can_stop(16, UNIT - way - 1, rate));
            assert!(can_stop(-16, way + 1, -rate) && !can_stop(-16, way, -rate));
        }
    }

    /// The speeds are those at which the zone's distance has least to spare.
    #[test]
    fn a_motor_at_the_edge_of_its_safe_zone_can_stop_until_the_next_check() {
        const FAST: [u32; 6] = [1, (1 << 22) - 1, 5_120_000, (1 << 23) - 1, 1 << 26, 1_280_000_000];
        let stops = (1..64).chain([1_000, 100_000]).flat_map(|t| FAST.map(|speed| (t, speed)));
        for (ticks, speed) in stops {
            for (behind, lag_ticks, per_pulse) in [(0, 0, 1), (0, 0, 16), (500_000, 2032, 1)] {
                let mut travel = TravelLimit::between(-MAX_TRAVEL, MAX_TRAVEL);
                travel.set_safe_zone(speed, ticks, behind, per_pulse);
                let units = i64::from(behind) * i64::from(UNIT);
                let ahead = units + i64::from(speed) * i64::from(SAFE_TICKS);
                let stop = Stop::over(ticks, lag_ticks);
                let (low, high) = travel.safe;
                let motor = MotorPosition { position: high, fraction: UNIT - 1, ahead, per_pulse };
                assert!(travel.can_stop(&motor, speed as i32, &stop), "{speed} in {ticks}");
                let motor = MotorPosition { position: low, fraction: 0, ahead: -ahead, per_pulse };
                assert!(travel.can_stop(&motor, -(speed as i32), &stop), "{speed} in {ticks}");
            }
        }
    }

    #[test]
    fn the_safe_zone_is_as_far_from_both_limits() {
        for (low, high) in [(-5_000, -1_000), (-3_000, 4_000), (1_000, 5_000)] {
            let mut travel = TravelLimit::between(low, high);
            travel.set_safe_zone(1, 1, 0, 16);
            let (first, last) = travel.safe;
            assert!(low < first && first < last, "{travel:?}");
            assert_eq!(first - low, high - last);
        }
    }

    proptest! {
        /// A motor that can stop by the bound stays within its travel, also where each tick begins
        /// another ramp; one that could stop with a pulse to spare is not held back.
        #[test]
        fn a_motor_that_can_stop_stays_within_its_travel(
            off in -3i32..40, high: bool, log in 0u32..5, shift in 0u32..22,
            rate in -1_280_000_000i32..=1_280_000_000, delta in 8u32..5_000_000, other in 0u32..300,
            fraction in 0..UNIT, ahead in -1_000_000_000i64..1_000_000_000, again: u64,
        ) {
            let (rate, per_pulse) = ((rate >> shift) as i64, 1 << log);
            prop_assume!(rate != 0);
            // Another motor may need longer.
            let ticks = (rate.unsigned_abs().div_ceil(u64::from(delta)) as u32).max(other);
            prop_assume!(ticks < 20_000);
            // The stop, with a new ramp in the ticks that `again` names.
            let (mut size, mut left, mut from, mut gone, mut over) =
                (rate.unsigned_abs(), ticks.into(), rate.unsigned_abs(), 0u64, u64::from(ticks));
            let mut now = from;
            while left > 0 {
                if again >> (left % 64) & 1 == 1 {
                    (from, over, gone) = (now, left, 0);
                }
                gone += 1;
                left -= 1;
                now = from - from * gone / over;
                size += now;
            }
            let signed = |size: i128| if rate < 0 { -size } else { size };
            let end_of = |units: i128| units.div_euclid(i128::from(UNIT)) * i128::from(per_pulse);
            let units = i128::from(fraction) + i128::from(ahead) + signed(i128::from(size));
            let end = end_of(units) as i32;
            let limits = (-(1i32 << 28), 1i32 << 28);
            let position = if high { limits.1 } else { limits.0 } - end + off * per_pulse;
            prop_assume!((limits.0..=limits.1).contains(&position));
            let travel = TravelLimit::between(limits.0, limits.1);
            let motor = MotorPosition { position, fraction, ahead, per_pulse };
            let can = travel.can_stop(&motor, rate as i32, &Stop::over(ticks, 0));
            let reached = position + end;
            let inside = if rate > 0 { reached <= limits.1 } else { reached >= limits.0 };
            prop_assert!(!can || inside, "{end}");
            let more = units + signed(i128::from(ticks) * i128::from(ticks) / 4 + 3);
            let spare = if rate > 0 {
                i128::from(position) + end_of(more) <= i128::from(limits.1)
            } else {
                i128::from(position) + end_of(more) >= i128::from(limits.0)
            };
            prop_assert!(can || !spare);
        }

        /// A motor in its safe zone can stop.
        #[test]
        fn a_motor_in_its_safe_zone_can_stop(
            high in 0i32..1 << 29, part in 0.0f64..=1.0, shift in 0u32..30,
            most in 1u32..1_280_000_000, share in -1.0f64..=1.0, all_ticks in 1u32..200_000,
            later in 0..SAFE_TICKS, fraction in 0..UNIT, ahead in 0u32..600_000,
            ahead_share in -1.0f64..=1.0, log in 0u32..5,
        ) {
            let (speed, per_pulse) = ((most >> shift).max(1), 1 << log);
            let mut travel = TravelLimit::between(-high, high);
            travel.set_safe_zone(speed, all_ticks, ahead, per_pulse);
            let position = (f64::from(high) * (2.0 * part - 1.0)) as i32;
            prop_assume!(travel.in_safe_zone(position));
            let rate = (f64::from(speed) * share) as i32;
            let ahead = (f64::from(ahead) * f64::from(UNIT) * ahead_share) as i64;
            // The reference moves on until the next check.
            let sign = if share < 0.0 { -1 } else { 1 };
            let ahead = ahead + i64::from(speed) * i64::from(later) * sign;
            let motor = MotorPosition { position, fraction, ahead, per_pulse };
            let ticks = (f64::from(all_ticks) * share.abs()).ceil() as u32;
            prop_assert!(travel.can_stop(&motor, rate, &Stop::over(ticks, 0)));
        }
    }
}
