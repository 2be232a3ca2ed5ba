//! Forecasts: where the reference gets, for laws whose setpoints take effect later, and how the
//! motors come to rest.

use super::planner::Planner;
use super::pulses::UNIT;
use super::ramp::ticks_for;
use crate::clock::TICK_US;
use crate::wide;

/// Longest forecast, ticks: 51 ms.
const MAX_TICKS: u32 = 256;

/// Bits that are dropped from units, so that a forecast's movement fits 32.
const DROPPED_BITS: u32 = 9;
const _: () = assert!((UNIT / 16) % (1 << DROPPED_BITS) == 0);

/// How the motors come to rest without a new setpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunOut {
    /// Where they come to rest, Q4 steps.
    pub motors: [i32; 3],
    /// Longest time until then, µs.
    pub time_us: u64,
}

impl Planner {
    /// Returns how the motors come to rest if their rates ramp to zero from now on. The positions
    /// are accurate to about a microstep.
    pub(crate) fn run_out(&self) -> RunOut {
        let ticks = ticks_for(self.ramp.rates.map(i32::unsigned_abs), self.deltas);
        let (mut motors, per_q4) = (self.reference(), (UNIT / 16 * self.microsteps) as u32);
        for (motor, rate) in motors.iter_mut().zip(self.ramp.rates) {
            // Half of the way at the present rate. Bits: rate 31 + ticks 28; the motor can stop
            // within its travel, so that the quotient has 30.
            let way = wide::product(rate.unsigned_abs(), ticks) / 2;
            let turn = wide::quotient(way, per_q4) as i32;
            *motor = motor.saturating_add(if rate < 0 { -turn } else { turn });
        }
        let time_us = u64::from(ticks + self.mean.lag_ticks()) * u64::from(TICK_US);
        RunOut { motors, time_us }
    }
}

impl Planner {
    /// Returns the same as [`reference`](Self::reference) where the reference stands still only
    /// after `ticks` more ticks (at most 256) of the present ramp; Q4 steps, accurate to about one.
    pub(crate) fn reference_after(&self, ticks: u32) -> [i32; 3] {
        let ticks = ticks.min(MAX_TICKS);
        let mut reference = self.reference();
        for (reference, turned) in reference.iter_mut().zip(self.ramp.turned(ticks)) {
            // Bits: rates 31 + ticks 8 - dropped 9.
            let units = (turned >> DROPPED_BITS) as i32;
            *reference =
                reference.saturating_add(units / ((UNIT / 16 * self.microsteps) >> DROPPED_BITS));
        }
        reference
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::MotorRates;
    use crate::plan::moving_average::MovingAverage;
    use crate::plan::travel_limit::TravelLimit;
    use proptest::prelude::*;

    /// Returns a planner of motors that turn at `rates` after a while, with the moving average.
    fn turning(microsteps: i32, deltas: [u32; 3], rates: [i32; 3], mean_ms: u16) -> Planner {
        let travels = [TravelLimit::between(-(1 << 29), 1 << 29); 3];
        let mut planner = Planner::default();
        planner.set_microsteps(1 << microsteps);
        (planner.deltas, planner.travels) = (deltas, travels);
        planner.mean = MovingAverage::over(mean_ms);
        planner.axes.iter_mut().for_each(|axis| axis.configure(false, 1 << microsteps));
        planner.set_rates(MotorRates(rates), 0);
        (0..500).for_each(|_| _ = planner.tick());
        planner
    }

    proptest! {
        /// Against the plan itself.
        #[test]
        fn the_motors_come_to_rest_where_and_when_it_was_said(
            microsteps in 0..5,
            deltas in proptest::array::uniform3(20_000u32..2_000_000),
            before in proptest::array::uniform3(-102_400i32..102_400),
            rates in proptest::array::uniform3(-102_400i32..102_400),
            (gone, mean_ms) in (0u32..100, 0u16..=400),
        ) {
            let mut planner = turning(microsteps, deltas, before, mean_ms);
            planner.set_rates(MotorRates(rates), 0);
            (0..gone).for_each(|_| _ = planner.tick());
            let said = planner.run_out();
            planner.set_rates(MotorRates([0; 3]), 0);
            let ticks = said.time_us / u64::from(TICK_US);
            (0..ticks).for_each(|_| _ = planner.tick());
            prop_assert!(!planner.moving());
            for (said, is) in said.motors.into_iter().zip(planner.positions()) {
                prop_assert!((said - is).abs() <= 1 + (16 >> microsteps), "{said} {is}");
            }
        }

        /// Against the plan itself.
        #[test]
        fn the_reference_gets_where_it_was_said_to_get(
            microsteps in 0..5,
            deltas in proptest::array::uniform3(2_000u32..2_000_000),
            rates in proptest::array::uniform3(-102_400i32..102_400),
            before in proptest::array::uniform3(-102_400i32..102_400),
            (ramp_us, gone, ticks) in (0u32..50_000, 0u32..100, 0u32..=MAX_TICKS),
        ) {
            let mut planner = turning(microsteps, deltas, before, 0);
            planner.set_rates(MotorRates(rates), ramp_us);
            (0..gone).for_each(|_| _ = planner.tick());
            let said = planner.reference_after(ticks);
            (0..ticks).for_each(|_| _ = planner.tick());
            for (said, is) in said.into_iter().zip(planner.reference()) {
                // Rounded to microsteps, which are 1/16 steps times these.
                prop_assert!((said - is).abs() <= 1 + (16 >> microsteps), "{said} {is}");
            }
        }
    }
}
