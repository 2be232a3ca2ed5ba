//! Forecast of the reference, for laws whose setpoints take effect later.

use super::planner::Planner;
use super::pulses::UNIT;

/// Longest forecast, ticks: 51 ms.
const MAX_TICKS: u32 = 256;

/// Bits that are dropped from units, so that a forecast's movement fits 32.
const DROPPED_BITS: u32 = 9;
const _: () = assert!((UNIT / 16) % (1 << DROPPED_BITS) == 0);

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
    use crate::plan::travel_limit::TravelLimit;
    use proptest::prelude::*;

    proptest! {
        /// Against the plan itself.
        #[test]
        fn the_reference_gets_where_it_was_said_to_get(
            microsteps in 0..5,
            deltas in proptest::array::uniform3(2_000u32..2_000_000),
            rates in proptest::array::uniform3(-102_400i32..102_400),
            before in proptest::array::uniform3(-102_400i32..102_400),
            (ramp_us, gone, ticks) in (0u32..50_000, 0u32..100, 0u32..=MAX_TICKS),
        ) {
            let travels = [TravelLimit::between(-(1 << 29), 1 << 29); 3];
            let mut planner = Planner::default();
            planner.set_microsteps(1 << microsteps);
            (planner.deltas, planner.travels) = (deltas, travels);
            planner.axes.iter_mut().for_each(|axis| axis.configure(false, 1 << microsteps));
            planner.set_rates(MotorRates(before), 0);
            (0..500).for_each(|_| _ = planner.tick());
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
