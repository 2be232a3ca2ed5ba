//! One motor's microsteps: how many of them a tick passes, and when.
//!
//! While the rate changes, a tick divides for its moments. While it does not, each tick's moments
//! follow from the last one's by additions, with the remainders carried, so that they are the very
//! same.

use super::clocks::{self, Quotient};
use super::pulses::{Pulses, UNIT};
use crate::clock::TICK_CLOCKS;

/// UNIT as what is counted with.
const MICROSTEP: u32 = UNIT.unsigned_abs();

/// Below this a pulse may be more clocks away than 31 bits hold; units.
const SLOW: u32 = 64;
const _: () = assert!(MICROSTEP as u64 * TICK_CLOCKS as u64 / (SLOW as u64) < 1 << 31);

#[derive(Debug, Clone, Copy)]
pub(super) struct Axis {
    pub(super) reversed: bool,
    /// Pulses given, 1/16 steps.
    pub(super) position: i32,
    /// What a pulse is, as a shift of 1/16 steps.
    shift: u32,
    /// Whether the rate is, or was last, above 0.
    up: bool,
    /// Units to before the next pulse in that direction: [0, UNIT). All pulses lie before a tick's
    /// end.
    to_next: u32,
    /// The rate of the last tick, units.
    rate: i32,
    /// What is known of that rate, once it has lasted for a tick.
    cruise: Option<Cruise>,
}

/// A rate that does not change.
#[derive(Debug, Clone, Copy)]
struct Cruise {
    /// Until the next pulse, clocks; in parts of `speed`.
    first: Quotient,
    speed: u32,
    /// A tick passes the greater number of pulses where the first is less than so many units away.
    part: u32,
    fewer: Stretch,
    more: Stretch,
}

/// A tick with a certain number of pulses: what it adds, wrapping.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    /// To `first`.
    clocks: Quotient,
    /// To the units before the next pulse.
    units: u32,
    /// To the position.
    way: i32,
    count: u16,
}

impl Axis {
    pub(super) const AT_REST: Self = Self {
        reversed: false,
        position: 0,
        shift: 0,
        up: false,
        to_next: MICROSTEP / 2,
        rate: 0,
        cruise: None,
    };

    /// Takes over what the motor is configured for; at standstill.
    pub(super) fn configure(&mut self, reversed: bool, microsteps: i32) {
        let shift = 4 - microsteps.trailing_zeros();
        *self = Self { reversed, shift, position: self.position, ..Self::AT_REST };
    }

    /// Stopped dead, in the middle of a microstep, `back` pulses short of where it was planned to
    /// be.
    pub(super) fn cut(&mut self, back: i32) {
        *self = Self {
            position: self.position - (back << self.shift),
            to_next: MICROSTEP / 2,
            up: false,
            ..*self
        };
        (self.rate, self.cruise) = (0, None);
    }

    /// How far the motor is to be beyond the last pulse, units: [0, UNIT).
    pub(super) fn fraction(&self) -> i32 {
        let fraction = if self.up { MICROSTEP - 1 - self.to_next } else { self.to_next };
        fraction as i32
    }

    /// Moves the motor by a tick at `rate`; `pulses`, which are those of the last tick, become what
    /// it passes.
    #[inline(never)]
    pub(super) fn advance(&mut self, rate: i32, pulses: &mut Pulses) {
        if rate != self.rate {
            *pulses = self.change(rate);
        } else if self.cruise.is_some() {
            self.cruise(pulses);
        } else if rate != 0 {
            *pulses = self.settle();
        }
    }

    /// Whether the next ticks at the same rate need but [`cruise`].
    pub(super) fn cruises(&self) -> bool {
        self.cruise.is_some() || self.rate == 0
    }

    /// A tick at the same rate as the last two; direction and period of the pulses are those of the
    /// last tick.
    #[inline(never)]
    pub(super) fn cruise(&mut self, pulses: &mut Pulses) {
        if let Some(cruise) = &mut self.cruise {
            let stretch = if self.to_next < cruise.part { &cruise.more } else { &cruise.fewer };
            pulses.count = stretch.count;
            pulses.first = cruise.first.whole;
            self.to_next = self.to_next.wrapping_add(stretch.units);
            self.position = self.position.wrapping_add(stretch.way);
            // Both rests are below `speed`, of 31 bits.
            let mut rest = cruise.first.rest.wrapping_add(stretch.clocks.rest);
            let mut whole = cruise.first.whole.wrapping_add(stretch.clocks.whole);
            if rest >= cruise.speed {
                rest = rest.wrapping_sub(cruise.speed);
                whole = whole.wrapping_add(1);
            }
            cruise.first = Quotient { whole, rest };
        }
    }

    /// A tick at the rate of the last one, which is the first to be so.
    fn settle(&mut self) -> Pulses {
        let speed = self.rate.unsigned_abs();
        if speed < SLOW {
            return self.pass(speed);
        }
        let (whole, part) = clocks::split(speed);
        let other = MICROSTEP - part;
        let [back, forth, first] =
            [part, other, self.to_next].map(|units| clocks::until(units, speed));
        let stretch = |count: u32, units: u32, clocks| {
            let way = (count << self.shift) as i32;
            Stretch { clocks, units, way: if self.up { way } else { -way }, count: count as u16 }
        };
        let fewer = stretch(whole, part.wrapping_neg(), back.negative(speed));
        let more = stretch(whole + 1, other, forth);
        self.cruise = Some(Cruise { first, speed, part, fewer, more });
        let period = if whole > 0 { clocks::period(speed) } else { TICK_CLOCKS };
        let mut pulses = Pulses { direction: self.up != self.reversed, period, ..Pulses::NONE };
        self.cruise(&mut pulses);
        pulses
    }

    /// A tick at another rate than the last one.
    fn change(&mut self, rate: i32) -> Pulses {
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

    /// A tick at `speed` (above 0).
    fn pass(&mut self, speed: u32) -> Pulses {
        let direction = self.up != self.reversed;
        if speed <= self.to_next {
            self.to_next -= speed;
            return Pulses { direction, ..Pulses::NONE };
        }
        // Pulses are passed at to_next, to_next + UNIT, ..., below `speed`.
        let (more, left) = clocks::split(speed - 1 - self.to_next);
        let first = clocks::until(self.to_next, speed).whole;
        self.to_next = MICROSTEP - 1 - left;
        let count = more + 1;
        let way = (count << self.shift) as i32;
        self.position += if self.up { way } else { -way };
        let period = if more > 0 { clocks::period(speed) } else { TICK_CLOCKS };
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
            stretches in proptest::collection::vec((rates(), 1usize..300), 1..8), reversed: bool, shift in 0u32..5
        ) {
            let mut axis = Axis::AT_REST;
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
                        prop_assert!(pulses.period <= TICK_CLOCKS && end <= last && last - end <= u32::from(pulses.count));
                    }
                    prop_assert_eq!(i128::from(axis.position), at.div_euclid(i128::from(UNIT)) * i128::from(16 >> shift));
                    prop_assert_eq!(i128::from(axis.fraction()), at.rem_euclid(i128::from(UNIT)));
                }
            }
        }
    }
}
