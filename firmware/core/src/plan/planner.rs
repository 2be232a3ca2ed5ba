//! The step planner: ramps, moving average, travel limits and pulses of the three motors.

use super::axis::Axis;
use super::history::History;
use super::mean::Mean;
use super::pulses::{Pulses, RATE_BITS, StepPlan, UNIT};
use super::ramp::{Ramp, ticks_for};
use super::travel::{PATIENCE, Place, Stop, Travel};
use crate::clock::TICK_US;
use crate::law::MotorRates;
use crate::params::Params;

/// Turns wanted rates into step plans and knows where the motors are.
#[derive(Debug, Clone, Copy)]
pub struct Planner {
    pub(super) axes: [Axis; 3],
    pub(super) travels: [Travel; 3],
    /// Highest change of each motor's rate a tick, at least 8; 24 bits.
    pub(super) deltas: [u32; 3],
    /// Pulses that each motor may be behind its reference, at most: 20 bits.
    behind: [u32; 3],
    pub(super) microsteps: i32,
    /// 1/16 steps of a pulse; and what makes a pulse rate of Q8 full steps/s, as a shift.
    per_pulse: i32,
    shift: u32,
    pub(super) ramp: Ramp,
    pub(super) mean: Mean,
    /// Present rates of the motors, which follow the ramp's through the mean.
    turning: [i32; 3],
    history: History,
    /// Whether the motors turn as they did, at rates that they have had for two ticks.
    steady: bool,
    /// Ticks for which no motor comes near its travel's end.
    safe_for: u32,
    plan: StepPlan,
}

impl Default for Planner {
    fn default() -> Self {
        Self {
            axes: [Axis::AT_REST; 3],
            travels: [Travel::between(0, 0); 3],
            deltas: [8; 3],
            behind: [0; 3],
            microsteps: 16,
            per_pulse: 1,
            shift: 4 + RATE_BITS - 8,
            ramp: Ramp::AT_REST,
            mean: Mean::OFF,
            turning: [0; 3],
            history: History::EMPTY,
            steady: false,
            safe_for: 0,
            plan: StepPlan { motors: [Pulses::NONE; 3] },
        }
    }
}

impl Planner {
    /// Takes over the motors' limits; call at standstill. Positions go on. A motor that stands
    /// outside its travel turns inwards only.
    pub fn configure(&mut self, params: &Params) {
        self.set_microsteps(i32::from(params.microsteps));
        self.mean = Mean::over(params.mean_ms);
        for (i, motor) in params.motors.iter().enumerate() {
            self.axes[i].configure(motor.reversed, self.microsteps);
            self.travels[i] = Travel::between(motor.travel_min.0, motor.travel_max.0);
            // Rounded down, so that the limit holds. Bits: acceleration 22, microsteps 5, fraction
            // 10, tick 8.
            let per_second =
                (u64::from(motor.max_acceleration.0) * params.microsteps as u64) << RATE_BITS;
            self.deltas[i] = (per_second * u64::from(TICK_US) / 1_000_000) as u32;
            // A tick's pulses have 8 bits; the longest mean, 12.
            let pulses = self.per_second(motor.max_rate.0) / UNIT + 1;
            self.behind[i] = pulses.unsigned_abs() * self.mean.lag_ticks();
        }
        self.ramp = Ramp::AT_REST;
        self.plan = StepPlan { motors: [Pulses::NONE; 3] };
        self.look_ahead();
    }

    /// Microsteps of a full step, a power of two up to 16.
    pub(super) fn set_microsteps(&mut self, microsteps: i32) {
        self.microsteps = microsteps;
        self.per_pulse = 16 / microsteps;
        self.shift = microsteps.trailing_zeros() + RATE_BITS - 8;
    }

    /// What the motors do in the tick that was planned last.
    pub fn plan(&self) -> &StepPlan {
        &self.plan
    }

    /// Motor positions in 1/16 steps since the start: what was pulsed, to the end of the last tick.
    pub fn positions(&self) -> [i32; 3] {
        let [a, b, c] = &self.axes;
        [a.position, b.position, c.position]
    }

    /// The motors were stopped dead: they stand `missing` pulses each short of where they were
    /// planned to be, + where the direction line is high.
    pub fn cut(&mut self, missing: [i32; 3]) {
        (self.mean, self.turning) = (self.mean.emptied(), [0; 3]);
        self.ramp = Ramp::AT_REST;
        self.plan = StepPlan { motors: [Pulses::NONE; 3] };
        self.look_ahead();
        for (axis, missing) in self.axes.iter_mut().zip(missing) {
            axis.cut(if axis.reversed { -missing } else { missing });
        }
    }

    /// The same `age_us` ago, at most half a second.
    pub fn positions_ago(&self, age_us: u32) -> [i32; 3] {
        self.history.ago(age_us, self.positions())
    }

    /// Where the motors go on to through the running mean if the reference stands still from now
    /// on, 1/16 steps.
    pub fn reference(&self) -> [i32; 3] {
        let (positions, ahead) = (self.positions(), self.mean.ahead());
        // Rounded down to a microstep; travel limits keep the sum within an i32.
        [0, 1, 2].map(|i| {
            let microsteps =
                (i64::from(self.axes[i].fraction()) + ahead[i]).div_euclid(i64::from(UNIT));
            positions[i] + microsteps as i32 * self.per_pulse
        })
    }

    /// Present motor rates, Q8 steps/s, rounded towards zero.
    pub fn rates(&self) -> [i32; 3] {
        self.turning.map(|rate| rate / self.per_q8())
    }

    /// Units of a pulse rate in 1/256 full step/s.
    pub(super) fn per_q8(&self) -> i32 {
        self.microsteps << (RATE_BITS - 8)
    }

    /// A motor rate (Q8 full steps/s, within the limit) as a pulse rate. Microsteps are a power of
    /// two, and a shift is cheaper than a product that is checked: 31 bits by the build's highest
    /// pulse rate.
    fn per_second(&self, rate: i32) -> i32 {
        rate << self.shift
    }

    /// Whether any motor turns.
    pub fn moving(&self) -> bool {
        self.ramp.rates != [0; 3] || self.mean.moving()
    }

    /// The motor that would pass its travel if the ramp went on for a tick, with a ramp down after
    /// it; then the ramp is one to rest.
    fn mind_travel(&mut self) -> Option<usize> {
        if self.safe_for > 0 {
            self.safe_for -= 1;
            return None;
        }
        if (0..3).all(|i| self.travels[i].surely(self.axes[i].position)) {
            self.safe_for = PATIENCE - 1;
            return None;
        }
        let beyond = self.beyond_travel();
        if beyond.is_some() {
            self.ramp.to([0; 3], 0, self.deltas);
            self.look_ahead();
        }
        beyond
    }

    /// The motor that would pass its travel at the rates of the coming tick and with a ramp down
    /// after it.
    fn beyond_travel(&self) -> Option<usize> {
        let (rates, ahead) = (self.ramp.next(), self.mean.ahead());
        let ticks = ticks_for(rates.map(i32::unsigned_abs), self.deltas);
        let stop = Stop::over(ticks, self.mean.lag_ticks());
        (0..3).find(|&i| {
            let Axis { position, .. } = self.axes[i];
            let (fraction, per_pulse) = (self.axes[i].fraction(), self.per_pulse);
            let place = Place { position, fraction, ahead: ahead[i], per_pulse };
            !self.travels[i].can_stop(&place, rates[i], &stop)
        })
    }

    /// From the next tick on, goes towards the `wanted` rates (each within its motor's limit), over
    /// `ramp_us` at least.
    pub fn set_rates(&mut self, wanted: MotorRates, ramp_us: u32) {
        let wanted = wanted.0.map(|rate| self.per_second(rate));
        if self.ramp.ended_at(&wanted) {
            return;
        }
        self.ramp.to(wanted, ramp_us / TICK_US, self.deltas);
        self.look_ahead();
    }

    /// Finds out where in its travel each motor can surely stop on its way to the wanted rates.
    fn look_ahead(&mut self) {
        (self.steady, self.safe_for) = (false, 0);
        // No rate on the way is above the greater of its two ends, and no stop takes longer than
        // from those.
        let (now, then) = (self.ramp.rates, self.ramp.wanted());
        let fastest = [0, 1, 2].map(|i| now[i].unsigned_abs().max(then[i].unsigned_abs()));
        let ticks = ticks_for(fastest, self.deltas);
        for ((travel, fastest), behind) in self.travels.iter_mut().zip(fastest).zip(self.behind) {
            travel.expect(fastest, ticks, behind, self.per_pulse);
        }
    }

    /// Plans a tick towards the rates that were [aimed](Self::set_rates) at. Where a motor could then no
    /// longer stop within its travel, it plans a tick of ramping down instead, aims at rest, and
    /// names that motor.
    pub fn tick(&mut self) -> Option<usize> {
        let beyond = self.plan_tick();
        self.follow_up();
        beyond
    }

    /// The first part of a [`tick`](Self::tick): all that its pulses need.
    #[inline]
    pub fn plan_tick(&mut self) -> Option<usize> {
        if self.safe_for == 0 || !self.steady {
            return self.turn();
        }
        self.safe_for -= 1;
        self.cruise();
        None
    }

    /// The rest of a [`tick`](Self::tick), once: what later ones need.
    #[inline(always)]
    pub fn follow_up(&mut self) {
        if !self.mean.is_off() {
            self.mean.pass(self.ramp.rates);
        }
        if self.history.is_due() {
            self.history.enter(self.positions());
        }
    }

    /// A tick like the last.
    #[inline(always)]
    fn cruise(&mut self) {
        let ([a, b, c], [of_a, of_b, of_c]) = (&mut self.axes, &mut self.plan.motors);
        a.cruise(of_a);
        b.cruise(of_b);
        c.cruise(of_c);
        self.history.tick();
    }

    /// A tick in which the rates change, or are just no longer changing, or the travel is to be
    /// looked at.
    #[inline(never)]
    fn turn(&mut self) -> Option<usize> {
        let beyond = self.mind_travel();
        if self.steady {
            self.cruise();
            return beyond;
        }
        self.ramp.tick();
        self.turning = self.mean.rates(self.ramp.rates);
        for ((axis, rate), pulses) in
            self.axes.iter_mut().zip(self.turning).zip(&mut self.plan.motors)
        {
            axis.advance(rate, pulses);
        }
        self.steady = self.ramp.over() && self.mean.is_off() && self.axes.iter().all(Axis::cruises);
        self.history.tick();
        beyond
    }
}
