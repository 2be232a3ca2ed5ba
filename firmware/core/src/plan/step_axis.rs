//! Microsteps of one motor: how many of them a tick passes, and when.
//!
//! Positions within a microstep count in units of the reference ([`UNIT`] a microstep). While the
//! rate changes, each tick divides for the times of its pulses. At a constant rate, the times of a
//! tick follow from those of the last one by additions. The remainders are carried along, so both
//! ways give the same times to the clock.

use super::pulses::{self, Pulses, Quotient, UNIT};
use crate::timing::TICK_CLOCKS;

/// Units of a microstep, unsigned.
const MICROSTEP: u32 = UNIT.unsigned_abs();

/// Position and rate of one motor.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepAxis {
    /// Whether the motor pays out when its direction line is low.
    pub(super) reversed: bool,
    /// Position by the pulses given, Q4 steps.
    pub(super) position: i32,
    /// Q4 steps of a pulse, as a shift: 0 for 16 microsteps, 4 for full steps.
    shift: u32,
    /// Whether the last rate that was not 0 is positive.
    up: bool,
    /// Units to the position before the next pulse in that direction: [0, UNIT). All pulses lie
    /// before a tick's end.
    to_next: u32,
    /// Rate of the last tick, units.
    rate: i32,
    /// Extrapolation of that rate, once it has lasted for a tick.
    cruise: Option<Cruise>,
}

/// Extrapolation of a constant rate.
#[derive(Debug, Clone, Copy)]
struct Cruise {
    /// Clocks to the next pulse; the remainder is in 1/`speed`.
    first: Quotient,
    /// Magnitude of the rate, units a tick.
    speed: u32,
    /// `speed` modulo UNIT. A tick passes the greater number of pulses where the next pulse is
    /// nearer than this.
    part: u32,
    /// A tick with floor(`speed`/UNIT) pulses.
    fewer: CruiseTick,
    /// A tick with one pulse more.
    more: CruiseTick,
}

/// A tick at constant rate with a known number of pulses: its additions, which wrap.
#[derive(Debug, Clone, Copy)]
struct CruiseTick {
    /// Added to [`Cruise::first`].
    clocks: Quotient,
    /// Added to [`StepAxis::to_next`].
    units: u32,
    /// Added to [`StepAxis::position`].
    position: i32,
    /// Number of pulses.
    count: u16,
}

impl StepAxis {
    pub(super) const AT_REST: Self = Self {
        reversed: false,
        position: 0,
        shift: 0,
        up: false,
        to_next: MICROSTEP / 2,
        rate: 0,
        cruise: None,
    };

    /// Takes over the motor's configuration; at standstill.
    pub(super) fn configure(&mut self, reversed: bool, microsteps: i32) {
        let shift = 4 - microsteps.trailing_zeros();
        *self = Self { reversed, shift, position: self.position, ..Self::AT_REST };
    }

    /// Stops at once, in the middle of a microstep, `back` pulses short of the planned position.
    pub(super) fn cut(&mut self, back: i32) {
        *self = Self {
            position: self.position - (back << self.shift),
            to_next: MICROSTEP / 2,
            up: false,
            ..*self
        };
        (self.rate, self.cruise) = (0, None);
    }

    /// Returns the planned position beyond the last pulse, units: [0, UNIT).
    pub(super) fn fraction(&self) -> i32 {
        let fraction = if self.up { MICROSTEP - 1 - self.to_next } else { self.to_next };
        fraction as i32
    }

    /// Moves the motor by a tick at `rate` (units). `pulses` holds the pulses of the last tick and
    /// becomes those of this one.
    #[inline(never)]
    pub(super) fn advance(&mut self, rate: i32, pulses: &mut Pulses) {
        if rate != self.rate {
            *pulses = self.change_rate(rate);
        } else if self.cruise.is_some() {
            self.cruise(pulses);
        } else if rate != 0 {
            *pulses = self.begin_cruise();
        }
    }

    /// Returns whether [`cruise`](Self::cruise) is enough for further ticks at the same rate.
    pub(super) fn cruises(&self) -> bool {
        self.cruise.is_some() || self.rate == 0
    }

    /// Passes a tick at the same rate as the last two. Direction and period of the pulses stay.
    #[inline(never)]
    pub(super) fn cruise(&mut self, pulses: &mut Pulses) {
        if let Some(cruise) = &mut self.cruise {
            let tick = if self.to_next < cruise.part { &cruise.more } else { &cruise.fewer };
            pulses.count = tick.count;
            pulses.first = cruise.first.whole;
            self.to_next = self.to_next.wrapping_add(tick.units);
            self.position = self.position.wrapping_add(tick.position);
            // Both remainders are below `speed`, which has 31 bits: the sum has 32.
            let mut rest = cruise.first.rest.wrapping_add(tick.clocks.rest);
            let mut whole = cruise.first.whole.wrapping_add(tick.clocks.whole);
            if rest >= cruise.speed {
                rest = rest.wrapping_sub(cruise.speed);
                whole = whole.wrapping_add(1);
            }
            cruise.first = Quotient { whole, rest };
        }
    }

    /// Passes a tick at the rate of the last one, which was the first at that rate.
    fn begin_cruise(&mut self) -> Pulses {
        let speed = self.rate.unsigned_abs();
        // The times of slow pulses are beyond 32 bits. They wrap, and each is exact in the tick of
        // its pulse.
        let (whole, part) = pulses::split(speed);
        let other = MICROSTEP - part;
        let [back, forth, first] =
            [part, other, self.to_next].map(|units| pulses::until(units, speed));
        let tick = |count: u32, units: u32, clocks| {
            let moved = (count << self.shift) as i32;
            let position = if self.up { moved } else { -moved };
            CruiseTick { clocks, units, position, count: count as u16 }
        };
        let fewer = tick(whole, part.wrapping_neg(), back.negative(speed));
        let more = tick(whole + 1, other, forth);
        self.cruise = Some(Cruise { first, speed, part, fewer, more });
        let period = if whole > 0 { pulses::period(speed) } else { TICK_CLOCKS };
        let mut pulses = Pulses { direction: self.up != self.reversed, period, ..Pulses::NONE };
        self.cruise(&mut pulses);
        pulses
    }

    /// Passes a tick at another rate than the last one.
    fn change_rate(&mut self, rate: i32) -> Pulses {
        (self.rate, self.cruise) = (rate, None);
        if rate == 0 {
            return Pulses::NONE;
        }
        if (rate > 0) != self.up {
            self.up = rate > 0;
            self.to_next = MICROSTEP - 1 - self.to_next;
        }
        self.pass(rate.unsigned_abs())
    }

    /// Passes a tick at `speed` (units, above 0) in the present direction.
    fn pass(&mut self, speed: u32) -> Pulses {
        let direction = self.up != self.reversed;
        if speed <= self.to_next {
            self.to_next -= speed;
            return Pulses::NONE;
        }
        // Pulses lie at to_next, to_next + UNIT, ..., below `speed`.
        let (more, left) = pulses::split(speed - 1 - self.to_next);
        let first = pulses::until(self.to_next, speed).whole;
        self.to_next = MICROSTEP - 1 - left;
        let count = more + 1;
        let moved = (count << self.shift) as i32;
        self.position += if self.up { moved } else { -moved };
        let period = if more > 0 { pulses::period(speed) } else { TICK_CLOCKS };
        Pulses { direction, count: count as u16, first, period }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// How many pulses a tick has, and when its first and last come, by definition; `at` and `at +
    /// rate` are where the motor is at its beginning and end, units.
    fn exact(at: i128, rate: i32) -> (i128, u32, u32) {
        let (unit, to) = (i128::from(UNIT), at + i128::from(rate));
        let count = (to.div_euclid(unit) - at.div_euclid(unit)).abs();
        // Upwards a microstep begins with its first unit, downwards it ends with it.
        let to_first = if rate > 0 { unit - 1 - at.rem_euclid(unit) } else { at.rem_euclid(unit) };
        let moment = |k: i128| {
            (to_first + k * unit) * i128::from(TICK_CLOCKS) / i128::from(rate.unsigned_abs()).max(1)
        };
        (count, moment(0) as u32, moment(count - 1) as u32)
    }

    fn rates() -> impl Strategy<Value = i32> {
        (0u32..30, -1_280_000_000i32..=1_280_000_000).prop_map(|(shift, rate)| rate >> shift)
    }

    proptest! {
        /// Counts, first moments and positions are those of whole numbers without a limit, however
        /// long a rate lasts.
        #[test]
        fn pulses_are_where_the_motor_passes_its_microsteps(
            stretches in proptest::collection::vec((rates(), 1usize..300), 1..8),
            reversed: bool,
            shift in 0u32..5,
        ) {
            let mut axis = StepAxis::AT_REST;
            axis.configure(reversed, 1 << shift);
            let mut at = i128::from(axis.fraction());
            let mut pulses = Pulses::NONE;
            for (rate, ticks) in stretches {
                for _ in 0..ticks {
                    axis.advance(rate, &mut pulses);
                    let (count, first, last) = exact(at, rate);
                    at += i128::from(rate);
                    prop_assert_eq!(i128::from(pulses.count), count);
                    if count > 0 {
                        prop_assert_eq!(pulses.first, first);
                        prop_assert_eq!(pulses.direction, (rate > 0) != reversed);
                        // The period's fraction of a clock is left out, at most one for each pulse.
                        let end = pulses.first + u32::from(pulses.count - 1) * pulses.period;
                        prop_assert!(pulses.period <= TICK_CLOCKS && end <= last);
                        prop_assert!(last - end <= u32::from(pulses.count));
                    }
                    let pulses_given = at.div_euclid(i128::from(UNIT));
                    let position = pulses_given * i128::from(16 >> shift);
                    prop_assert_eq!(i128::from(axis.position), position);
                    prop_assert_eq!(i128::from(axis.fraction()), at.rem_euclid(i128::from(UNIT)));
                }
            }
        }
    }

    /// At 7 units a tick the first pulse is 9.1e9 clocks away: more than 32 bits.
    #[test]
    fn slow_pulses_come_at_their_time() {
        for rate in [7, -7, 63] {
            let mut axis = StepAxis::AT_REST;
            axis.configure(false, 16);
            let (mut at, mut pulses) = (i128::from(axis.fraction()), Pulses::NONE);
            for _ in 0..400_000 {
                axis.advance(rate, &mut pulses);
                let (count, first, _) = exact(at, rate);
                at += i128::from(rate);
                assert_eq!(i128::from(pulses.count), count);
                assert!(count == 0 || pulses.first == first, "{first}: {pulses:?}");
            }
            assert_eq!(i128::from(axis.position), at.div_euclid(i128::from(UNIT)));
            assert_ne!(axis.position, 0);
        }
    }

    #[test]
    fn a_motor_that_is_cut_off_stands_in_the_middle_of_a_microstep() {
        for rate in [7_000_001, -7_000_001] {
            let mut axis = StepAxis::AT_REST;
            axis.configure(false, 8);
            (0..5).for_each(|_| axis.advance(rate, &mut Pulses::NONE.clone()));
            let position = axis.position;
            axis.cut(3);
            assert_eq!((axis.position, axis.fraction()), (position - 6, UNIT / 2));
        }
    }
}
