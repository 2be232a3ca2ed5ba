//! Linear ramp of three rates from the present ones to the wanted ones, with one common factor.

use plumb_protocol::dimension::{MOTORS, PerMotor};

use crate::vector::per_motor;

/// A change of three pulse rates, spread evenly over some ticks. A tick takes additions only.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ramp {
    /// Present rates, units; 31 bits with the sign.
    pub(super) rates: PerMotor<i32>,
    /// Rates at the end of the ramp.
    wanted: PerMotor<i32>,
    /// Ticks of the whole ramp.
    ticks: u32,
    /// Ticks that are left.
    left: u32,
    lanes: PerMotor<Lane>,
}

/// Change of one motor's rate: `step` every tick, and `rest`/`ticks` of `unit` besides.
#[derive(Debug, Clone, Copy, Default)]
struct Lane {
    step: i32,
    /// +1 or -1, in the direction of the change.
    unit: i32,
    rest: u32,
    /// Sum of the `rest`s, in 1/`ticks`.
    gathered: u32,
}

impl Ramp {
    pub(super) const AT_REST: Self = Self {
        rates: [0; MOTORS],
        wanted: [0; MOTORS],
        ticks: 1,
        left: 0,
        lanes: [Lane { step: 0, unit: 0, rest: 0, gathered: 0 }; MOTORS],
    };

    /// Returns the rates at the end of the ramp.
    pub(super) fn wanted(&self) -> PerMotor<i32> {
        self.wanted
    }

    /// Returns whether the ramp is over and its rates are `wanted`. (The compiler would compare
    /// whole arrays by a call.)
    pub(super) fn ended_at(&self, wanted: &PerMotor<i32>) -> bool {
        self.over() && self.wanted.iter().zip(wanted).all(|(a, b)| a == b)
    }

    /// Returns whether the ramp is over.
    pub(super) fn over(&self) -> bool {
        self.left == 0
    }

    /// Begins a ramp from the present rates to `wanted`, over at least `ticks` (below 2^31). A
    /// motor's rate changes by at most its `most` a tick. All motors arrive in the same tick.
    pub(super) fn to(&mut self, wanted: PerMotor<i32>, ticks: u32, most: PerMotor<u32>) {
        self.wanted = wanted;
        self.left = 0;
        // Rates within the limits are at most 1.28e9: the difference of two has 32 bits.
        let changes = per_motor(|i| wanted[i].abs_diff(self.rates[i]));
        if changes[0] | changes[1] | changes[2] == 0 {
            return;
        }
        self.ticks = ticks_for(changes, most).max(ticks).max(1);
        self.left = self.ticks;
        for i in 0..MOTORS {
            let whole = changes[i] / self.ticks;
            // A division and a product take less time than two divisions.
            let rest = changes[i].wrapping_sub(whole.wrapping_mul(self.ticks));
            let (step, unit) =
                if wanted[i] < self.rates[i] { (-(whole as i32), -1) } else { (whole as i32, 1) };
            self.lanes[i] = Lane { step, unit, rest, gathered: 0 };
        }
    }

    /// Advances by a tick. No step exceeds its motor's `most`, which is a whole number and at least
    /// the exact step.
    pub(super) fn tick(&mut self) {
        if self.left == 0 {
            return;
        }
        self.left -= 1;
        for (rate, lane) in self.rates.iter_mut().zip(&mut self.lanes) {
            *rate += lane.step;
            // Both are below `ticks`, which has 29 bits.
            lane.gathered += lane.rest;
            if lane.gathered >= self.ticks {
                lane.gathered -= self.ticks;
                *rate += lane.unit;
            }
        }
    }

    /// Returns the sum of the rates of the next `ticks` ticks (at most 256). The error is at most
    /// `ticks`² units.
    pub(super) fn turned(&self, ticks: u32) -> PerMotor<i64> {
        let (rising, risen) = (ticks.min(self.left), ticks.saturating_sub(self.left));
        per_motor(|i| {
            // Bits: rates 31 + ticks 8; a step is at most the whole change over the ramp's ticks.
            i64::from(self.rates[i]) * i64::from(rising)
                + i64::from(self.lanes[i].step) * i64::from(rising * (rising + 1) / 2)
                + i64::from(self.wanted[i]) * i64::from(risen)
        })
    }

    /// Returns the rates after the next tick.
    pub(super) fn next(&self) -> PerMotor<i32> {
        if self.left == 0 {
            return self.rates;
        }
        per_motor(|i| {
            let (rate, lane) = (self.rates[i].wrapping_add(self.lanes[i].step), &self.lanes[i]);
            if lane.gathered + lane.rest >= self.ticks {
                rate.wrapping_add(lane.unit)
            } else {
                rate
            }
        })
    }
}

/// Returns the ticks in which three rates change by `changes`, each by at most its `most` (8 and
/// above) a tick: 29 bits.
pub(super) fn ticks_for(changes: PerMotor<u32>, most: PerMotor<u32>) -> u32 {
    let ticks = |i: usize| if changes[i] == 0 { 0 } else { (changes[i] - 1) / most[i] + 1 };
    ticks(0).max(ticks(1)).max(ticks(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// After k of n ticks, a rate is k/n of its way, rounded towards where it came from; and
        /// exact at the end.
        #[test]
        fn a_ramp_is_a_straight_line(
            ways in proptest::collection::vec(
                (proptest::array::uniform3(-1_280_000_000i32..=1_280_000_000), 0u32..300), 1..5),
            most in proptest::array::uniform3(8u32..50_000_000),
        ) {
            let mut ramp = Ramp::AT_REST;
            for (wanted, least) in ways {
                let from = ramp.rates;
                ramp.to(wanted, least, most);
                let changes = [0, 1, 2].map(|i| wanted[i].abs_diff(from[i]));
                let least = if changes == [0; 3] { 0 } else { least.max(1) };
                let ticks = ticks_for(changes, most).max(least);
                for k in 1..=ticks.min(2000) {
                    let (before, next) = (ramp.rates, ramp.next());
                    ramp.tick();
                    prop_assert_eq!(ramp.rates, next);
                    for i in 0..3 {
                        let change = i128::from(wanted[i]) - i128::from(from[i]);
                        let way = change * i128::from(k) / i128::from(ticks);
                        prop_assert_eq!(i128::from(ramp.rates[i]), i128::from(from[i]) + way);
                        prop_assert!(ramp.rates[i].abs_diff(before[i]) <= most[i]);
                    }
                }
                prop_assert_eq!(ramp.over(), ticks <= 2000);
                prop_assert!(!ramp.over() || ramp.rates == wanted);
            }
        }

        #[test]
        fn the_movement_of_the_coming_ticks_is_known(
            rates in proptest::array::uniform3(-1_280_000_000i32..=1_280_000_000),
            most in proptest::array::uniform3(1_000_000u32..50_000_000),
            gone in 0u32..1000, ticks in 0u32..=256,
        ) {
            let mut ramp = Ramp::AT_REST;
            ramp.to(rates, 0, most);
            (0..gone).for_each(|_| ramp.tick());
            let mut turned = ramp.turned(ticks);
            for _ in 0..ticks {
                ramp.tick();
                turned.iter_mut().zip(ramp.rates).for_each(|(way, rate)| *way -= i64::from(rate));
            }
            prop_assert!(turned.iter().all(|off| off.abs() <= i64::from(ticks * ticks)));
        }
    }

    #[test]
    fn equal_changes_of_two_motors_are_a_ramp() {
        for wanted in [[90, 90, 0], [90, 0, 90], [0, 90, 90], [90; 3]] {
            let mut ramp = Ramp::AT_REST;
            ramp.to(wanted, 0, [9; 3]);
            (0..10).for_each(|_| ramp.tick());
            assert!(ramp.over() && ramp.rates == wanted, "{ramp:?}");
        }
    }
}
