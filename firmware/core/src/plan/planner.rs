//! The step planner: ramps, moving average, travel limits and pulses of the three motors. Forecasts
//! say where the reference gets, for laws whose setpoints take effect later, and how the motors
//! come to rest.

use plumb_protocol::dimension::{MOTORS, PerMotor};

use super::history::History;
use super::moving_average::MovingAverage;
use super::pulses::{Pulses, RATE_BITS, StepPlan, UNIT};
use super::ramp::{Ramp, ticks_for};
use super::step_axis::StepAxis;
use super::travel_limit::{MotorPosition, SAFE_TICKS, Stop, TravelLimit};
use crate::law::{MotorRates, Setpoint};
use crate::params::Params;
use crate::timing::TICK_US;
use crate::vector::per_motor;
use crate::wide;

/// Turns wanted rates into step plans, and counts the motors' positions.
#[derive(Debug, Clone, Copy)]
pub struct Planner {
    pub(super) axes: PerMotor<StepAxis>,
    pub(super) travels: PerMotor<TravelLimit>,
    /// Motor positions at the zero of travel, Q4 steps since the start.
    zero: PerMotor<i32>,
    /// Highest change of each motor's rate a tick, units, at least 8; 24 bits.
    pub(super) deltas: PerMotor<u32>,
    /// Pulses that each motor may be behind its reference at most; 20 bits.
    behind: PerMotor<u32>,
    /// Microsteps of a full step, a power of two up to 16.
    pub(super) microsteps: i32,
    /// Q4 steps of a pulse.
    per_pulse: i32,
    /// Shift from a rate in Q8 full steps/s to a pulse rate.
    shift: u32,
    pub(super) ramp: Ramp,
    pub(super) mean: MovingAverage,
    /// Present rates of the motors, units: those of the ramp after the moving average.
    rates: PerMotor<i32>,
    history: History,
    /// Whether the motors turn at rates that have lasted for two ticks.
    steady: bool,
    /// Ticks for which all motors stay in their safe zones.
    safe_for: u32,
    /// Whether all motors were in their safe zones at the last check.
    safe: bool,
    plan: StepPlan,
}

impl Default for Planner {
    fn default() -> Self {
        Self {
            axes: [StepAxis::AT_REST; MOTORS],
            travels: [TravelLimit::between(0, 0); MOTORS],
            zero: [0; MOTORS],
            deltas: [8; MOTORS],
            behind: [0; MOTORS],
            microsteps: 16,
            per_pulse: 1,
            shift: 4 + RATE_BITS - 8,
            ramp: Ramp::AT_REST,
            mean: MovingAverage::OFF,
            rates: [0; MOTORS],
            history: History::EMPTY,
            steady: false,
            safe_for: 0,
            safe: false,
            plan: StepPlan { motors: [Pulses::NONE; MOTORS] },
        }
    }
}

impl Planner {
    /// Takes over the motors' limits; call at standstill. Positions go on. A motor that stands
    /// outside its travel turns inwards only.
    #[cold]
    pub fn configure(&mut self, params: &Params) {
        self.set_microsteps(i32::from(params.config.microsteps));
        self.mean = MovingAverage::over(params.config.mean.0);
        for (i, motor) in params.motors.iter().enumerate() {
            self.axes[i].configure(motor.reversed, self.microsteps);
            self.travels[i] = TravelLimit::about(self.zero[i], motor);
            // Rounded down, so that the limit holds. Bits: acceleration 22, microsteps 5, fraction
            // 10, tick 8.
            let per_second = (u64::from(motor.max_acceleration.0)
                * params.config.microsteps as u64)
                << RATE_BITS;
            self.deltas[i] = (per_second * u64::from(TICK_US) / 1_000_000) as u32;
            // Bits: a tick's pulses 8, the longest average 12.
            let pulses = self.pulse_rate(motor.max_rate.0) / UNIT + 1;
            self.behind[i] = pulses.unsigned_abs() * self.mean.lag_ticks();
        }
        self.ramp = Ramp::AT_REST;
        self.plan = StepPlan { motors: [Pulses::NONE; MOTORS] };
        self.plan_transition();
    }

    /// Makes the present positions the zero of travel; call at standstill. `params` are those in
    /// force. Positions since the start go on, so that coils and laws see no jump.
    #[cold]
    pub fn home(&mut self, params: &Params) {
        self.zero = self.positions();
        self.configure(params);
    }

    /// Returns the motor positions at the zero of travel, Q4 steps since the start.
    pub fn zero(&self) -> PerMotor<i32> {
        self.zero
    }

    /// Sets the microsteps of a full step, a power of two up to 16.
    pub(super) fn set_microsteps(&mut self, microsteps: i32) {
        self.microsteps = microsteps;
        self.per_pulse = 16 / microsteps;
        self.shift = microsteps.trailing_zeros() + RATE_BITS - 8;
    }

    /// Returns the pulses of the tick that was planned last.
    pub fn plan(&self) -> &StepPlan {
        &self.plan
    }

    /// Returns the motor positions at the end of the last tick by the pulses given, Q4 steps since
    /// the start.
    pub fn positions(&self) -> PerMotor<i32> {
        let [a, b, c] = &self.axes;
        [a.position, b.position, c.position]
    }

    /// Corrects the positions after an emergency stop: each motor stands `missing` pulses short of
    /// its planned position, + where the direction line is high.
    pub fn cut(&mut self, missing: PerMotor<i32>) {
        (self.mean, self.rates) = (self.mean.emptied(), [0; MOTORS]);
        self.ramp = Ramp::AT_REST;
        self.plan = StepPlan { motors: [Pulses::NONE; MOTORS] };
        self.plan_transition();
        for (axis, missing) in self.axes.iter_mut().zip(missing) {
            axis.cut(if axis.reversed { -missing } else { missing });
        }
    }

    /// Returns the motor positions `age_us` ago (at most half a second), Q4 steps.
    pub fn positions_ago(&self, age_us: u32) -> PerMotor<i32> {
        self.history.ago(age_us, self.positions())
    }

    /// Returns the motor positions that follow through the moving average if the reference stands
    /// still from now on, Q4 steps.
    pub fn reference(&self) -> PerMotor<i32> {
        let (positions, ahead) = (self.positions(), self.mean.ahead());
        // Rounded down to a microstep. The travel limits keep the sum within an i32.
        per_motor(|i| {
            let microsteps =
                (i64::from(self.axes[i].fraction()) + ahead[i]).div_euclid(i64::from(UNIT));
            positions[i] + microsteps as i32 * self.per_pulse
        })
    }

    /// Returns the present motor rates, Q8 steps/s, rounded towards zero.
    pub fn rates(&self) -> PerMotor<i32> {
        self.rates.map(|rate| rate / self.per_q8())
    }

    /// Returns the units of a pulse rate in 1/256 full step/s.
    pub(super) fn per_q8(&self) -> i32 {
        self.microsteps << (RATE_BITS - 8)
    }

    /// Converts a motor rate (Q8 full steps/s, within the limit) to a pulse rate: 31 bits by the
    /// build's highest pulse rate. A shift is cheaper than a checked product.
    fn pulse_rate(&self, rate: i32) -> i32 {
        rate << self.shift
    }

    /// Returns whether any motor turns.
    pub fn moving(&self) -> bool {
        self.ramp.rates != [0; MOTORS] || self.mean.moving()
    }

    /// Returns the motor that would pass its travel limit if the ramp went on for a tick and then
    /// to rest; the ramp then becomes one to rest.
    fn check_travel(&mut self) -> Option<usize> {
        if self.safe_for > 0 {
            self.safe_for -= 1;
            return None;
        }
        self.safe = (0..MOTORS).all(|i| self.travels[i].in_safe_zone(self.axes[i].position));
        if self.safe {
            self.safe_for = SAFE_TICKS - 1;
            return None;
        }
        let beyond = self.beyond_travel();
        if beyond.is_some() {
            self.ramp.to([0; MOTORS], 0, self.deltas);
            self.plan_transition();
        }
        beyond
    }

    /// Returns the motor that would pass its travel limit with a tick at the next rates and then a
    /// ramp to rest.
    fn beyond_travel(&self) -> Option<usize> {
        let (rates, ahead) = (self.ramp.next(), self.mean.ahead());
        let ticks = ticks_for(rates.map(i32::unsigned_abs), self.deltas);
        let stop = Stop::over(ticks, self.mean.lag_ticks());
        (0..MOTORS).find(|&i| {
            let motor = MotorPosition {
                position: self.axes[i].position,
                fraction: self.axes[i].fraction(),
                ahead: ahead[i],
                per_pulse: self.per_pulse,
            };
            !self.travels[i].can_stop(&motor, rates[i], &stop)
        })
    }

    /// Follows a setpoint from the next tick on; its rates are within the motors' limits. The span
    /// of the moving average changes as soon as the motors' accelerations and travels allow it.
    pub fn follow(&mut self, setpoint: &Setpoint) {
        if let Some(span_ms) = setpoint.span_ms {
            self.mean.want(span_ms);
        }
        self.set_rates(setpoint.rates, setpoint.ramp_us);
    }

    /// Ramps to the `wanted` rates (each within its motor's limit) from the next tick on, over
    /// `ramp_us` at least.
    pub fn set_rates(&mut self, wanted: MotorRates, ramp_us: u32) {
        let wanted = wanted.0.map(|rate| self.pulse_rate(rate));
        if self.ramp.ended_at(&wanted) {
            return;
        }
        self.ramp.to(wanted, ramp_us / TICK_US, self.deltas);
        self.plan_transition();
    }

    /// Prepares for a new ramp: computes the safe zone of each motor.
    fn plan_transition(&mut self) {
        (self.steady, self.safe_for) = (false, 0);
        // A rate on the way is at most the greater of both ends, and a stop takes at most as long
        // as from there.
        let (now, then) = (self.ramp.rates, self.ramp.wanted());
        let fastest = per_motor(|i| now[i].unsigned_abs().max(then[i].unsigned_abs()));
        let ticks = ticks_for(fastest, self.deltas);
        for ((travel, fastest), behind) in self.travels.iter_mut().zip(fastest).zip(self.behind) {
            travel.set_safe_zone(fastest, ticks, behind, self.per_pulse);
        }
    }

    /// Plans a tick towards the rates of [`set_rates`](Self::set_rates). Where a motor could then
    /// no longer stop within its travel, plans a tick of ramping down instead, sets the rates to 0,
    /// and returns that motor.
    pub fn tick(&mut self) -> Option<usize> {
        let beyond = self.plan_tick();
        self.follow_up();
        beyond
    }

    /// Does the first part of a [`tick`](Self::tick): everything that its pulses need.
    #[inline]
    pub fn plan_tick(&mut self) -> Option<usize> {
        if self.safe_for == 0 || !self.steady {
            return self.plan_changing_tick();
        }
        self.safe_for -= 1;
        self.cruise();
        None
    }

    /// Does the rest of a [`tick`](Self::tick): what later ticks need.
    #[inline(always)]
    pub fn follow_up(&mut self) {
        if !self.mean.is_off() {
            // In their safe zones the motors can stop with whatever is under way.
            self.mean.pass(self.ramp.rates, &self.deltas, self.safe);
        }
        if self.history.is_due() {
            self.history.enter(self.positions());
        }
    }

    /// Plans a tick at the rates of the last one.
    #[inline(always)]
    fn cruise(&mut self) {
        let ([a, b, c], [of_a, of_b, of_c]) = (&mut self.axes, &mut self.plan.motors);
        a.cruise(of_a);
        b.cruise(of_b);
        c.cruise(of_c);
        self.history.tick();
    }

    /// Plans a tick in which the rates change, or have just changed, or the travel is checked.
    #[inline(never)]
    fn plan_changing_tick(&mut self) -> Option<usize> {
        let beyond = self.check_travel();
        if self.steady {
            self.cruise();
            return beyond;
        }
        self.ramp.tick();
        self.rates = self.mean.rates(self.ramp.rates);
        for ((axis, rate), pulses) in
            self.axes.iter_mut().zip(self.rates).zip(&mut self.plan.motors)
        {
            axis.advance(rate, pulses);
        }
        self.steady =
            self.ramp.over() && self.mean.is_off() && self.axes.iter().all(StepAxis::cruises);
        self.history.tick();
        beyond
    }
}

/// Longest forecast, ticks: 51 ms.
const MAX_TICKS: u32 = 256;

/// Bits that are dropped from units, so that a forecast's movement fits 32.
const DROPPED_BITS: u32 = 9;
const _: () = assert!((UNIT / 16) % (1 << DROPPED_BITS) == 0);

/// How the motors come to rest without a new setpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunOut {
    /// Where they come to rest, Q4 steps.
    pub motors: PerMotor<i32>,
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
    pub(crate) fn reference_after(&self, ticks: u32) -> PerMotor<i32> {
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
    use proptest::prelude::*;

    use super::*;
    use crate::law::MotorRates;
    use crate::plan::moving_average::MovingAverage;
    use crate::plan::travel_limit::TravelLimit;

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
