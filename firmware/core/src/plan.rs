//! From wanted motor rates to pulses: ramps within the limits, exact step counts, no motor past its travel.
//!
//! Time goes in ticks of [`TICK_US`]. In a tick each motor turns at a constant rate; between ticks the rates move
//! towards the wanted ones with one common factor, so that the path in motor space bends as little as it can.

mod clocks;
mod history;
mod jog;
mod mean;

use plumb_protocol::config::Motor;

use crate::law::MotorRates;
use crate::params::Params;
use history::History;
pub use jog::Jogging;
pub(crate) use mean::LONGEST_MS as LONGEST_MEAN_MS;
use mean::Mean;

/// Length of a tick, microseconds: short enough that a new position changes the rates within 300 µs, long enough that
/// planning takes a few percent of the chip.
pub const TICK_US: u32 = 200;

/// The clock that pulses are placed on, per second: that of the chip, so that a plan is exact there.
pub const CLOCK_HZ: u32 = 125_000_000;

/// Clocks in a tick.
pub const TICK_CLOCKS: u32 = CLOCK_HZ / 1_000_000 * TICK_US;

/// Fraction bits of a pulse rate (microsteps/s), so that small accelerations still count in a tick.
const RATE_BITS: u32 = 10;

/// One microstep in units of the reference, which a pulse rate moves by itself every tick: 23 bits.
const UNIT: i32 = (1_000_000 / TICK_US as i32) << RATE_BITS;

/// What one motor does in a tick: `count` pulses, the k-th `first + k * period` clocks after the tick's start, all
/// before its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pulses {
    /// Level of the direction line: high where the cable is paid out, unless the motor is reversed.
    pub direction: bool,
    /// Number of pulses (microsteps).
    pub count: u16,
    /// When the first comes, clocks after the tick's start.
    pub first: u32,
    /// From one to the next, clocks; at most a tick.
    pub period: u32,
}

/// What the three motors do in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StepPlan {
    /// Motors A, B and C.
    pub motors: [Pulses; 3],
}

/// Turns wanted rates into step plans and knows where the motors are.
#[derive(Debug, Clone, Copy)]
pub struct Planner {
    axes: [Axis; 3],
    microsteps: i32,
    mean: Mean,
    /// Present rates of the motors, which follow the axes' through the mean.
    turning: [i32; 3],
    history: History,
}

#[derive(Debug, Clone, Copy)]
struct Axis {
    /// Highest change of rate a tick, at least 8; 24 bits.
    delta: i32,
    /// Travel, 1/16 steps.
    travel: (i32, i32),
    reversed: bool,
    /// Present rate of the reference, microsteps/s with [`RATE_BITS`]; 31 bits by the build's highest pulse rate.
    rate: i32,
    /// Pulses given, 1/16 steps.
    position: i32,
    /// How far the motor is to be beyond the last pulse: [0, UNIT).
    fraction: i32,
}

impl Axis {
    const AT_REST: Self =
        Self { delta: 8, travel: (0, 0), reversed: false, rate: 0, position: 0, fraction: UNIT / 2 };

    fn configure(&mut self, motor: &Motor, microsteps: i32) {
        // Rounded down, so that the limit holds. Bits: acceleration 22, microsteps 5, fraction 10, tick 8.
        let per_second = (u64::from(motor.max_acceleration.0) * microsteps as u64) << RATE_BITS;
        *self = Self {
            delta: (per_second * u64::from(TICK_US) / 1_000_000) as i32,
            travel: (motor.travel_min.0, motor.travel_max.0),
            reversed: motor.reversed,
            fraction: UNIT / 2,
            ..*self
        };
    }

    /// Whether the motor stays within its travel if its reference, `ahead` units beyond it, turns at `rate` for this tick
    /// and then stops over `ticks`.
    fn can_stop(&self, rate: i32, ahead: i64, ticks: i32, microsteps: i32) -> bool {
        // Most ticks are far from that: a way that is bounded in 32 bits will do for them.
        let few_ticks = ticks.unsigned_abs() < 1 << 13;
        let most = ((rate.unsigned_abs() >> 22) + 1) * (ticks.unsigned_abs().min(1 << 13) + 1);
        if few_ticks {
            // A microstep has 22.3 bits; half of `most`, what is ahead, and those begun, 1/16 steps.
            let pending = (ahead.unsigned_abs() >> 22) as u32 + 1;
            let way = ((most / 2 + 2 + pending) * 16) as i32;
            if self.travel.0 + way <= self.position && self.position <= self.travel.1 - way {
                return true;
            }
        }
        // This tick at `rate`, then rate·(1 - k/ticks) for k = 1.. : rate·(ticks + 1)/2 in all. Bits: rate 31, ticks 28.
        let units = i64::from(rate) * (i64::from(ticks) + 1) / 2;
        let pulses = (i64::from(self.fraction) + ahead + units).div_euclid(i64::from(UNIT));
        let end = i64::from(self.position) + pulses * i64::from(16 / microsteps);
        match rate.signum() {
            1 => end <= i64::from(self.travel.1),
            -1 => end >= i64::from(self.travel.0),
            _ => true,
        }
    }

    /// Moves the motor by a tick at `rate`; the pulses that it passes.
    fn advance(&mut self, rate: i32, microsteps: i32) -> Pulses {
        // Bits: rate 31 with its sign, fraction 23: fits, since the build's pulse rate leaves room.
        let reference = self.fraction + rate;
        let (pulses, fraction) = clocks::split(reference);
        let direction = (rate > 0) != self.reversed;
        // Units to before the first pulse: the rest of this microstep upwards, what was passed of it downwards; so all
        // pulses lie before the tick's end.
        let to_first = if rate > 0 { UNIT - 1 - self.fraction } else { self.fraction };
        self.fraction = fraction;
        // 1/16 steps: 8 bits of pulses by 4.
        self.position += pulses << (4 - microsteps.trailing_zeros());
        if pulses == 0 {
            return Pulses { direction, ..Pulses::default() };
        }
        let speed = rate.unsigned_abs();
        Pulses {
            direction,
            count: pulses.unsigned_abs() as u16,
            first: clocks::until(to_first.unsigned_abs(), speed),
            period: if pulses.unsigned_abs() > 1 { clocks::period(speed) } else { TICK_CLOCKS },
        }
    }
}

impl Default for Planner {
    fn default() -> Self {
        Self {
            axes: [Axis::AT_REST; 3],
            microsteps: 16,
            mean: Mean::OFF,
            turning: [0; 3],
            history: History::EMPTY,
        }
    }
}

impl Planner {
    /// Takes over the motors' limits; call at standstill. Positions go on.
    pub fn configure(&mut self, params: &Params) {
        self.microsteps = i32::from(params.microsteps);
        for (axis, motor) in self.axes.iter_mut().zip(&params.motors) {
            axis.configure(motor, self.microsteps);
        }
        self.mean = Mean::over(params.mean_ms);
    }

    /// Motor positions in 1/16 steps since the start: what was pulsed, to the end of the last tick.
    pub fn positions(&self) -> [i32; 3] {
        [0, 1, 2].map(|i| self.axes[i].position)
    }

    /// The motors were stopped dead: they stand `missing` pulses each short of where they were planned to be, + where
    /// the direction line is high.
    pub fn cut(&mut self, missing: [i32; 3]) {
        let per_pulse = 16 / self.microsteps;
        (self.mean, self.turning) = (self.mean.emptied(), [0; 3]);
        for (axis, missing) in self.axes.iter_mut().zip(missing) {
            axis.rate = 0;
            axis.fraction = UNIT / 2;
            axis.position -= (if axis.reversed { -missing } else { missing }) * per_pulse;
        }
    }

    /// The same `age_us` ago, at most half a second.
    pub fn positions_ago(&self, age_us: u32) -> [i32; 3] {
        self.history.ago(age_us, self.positions())
    }

    /// Where the motors go on to through the running mean if the reference stands still from now on, 1/16 steps.
    pub fn reference(&self) -> [i32; 3] {
        let (positions, ahead) = (self.positions(), self.mean.ahead());
        // Rounded down to a microstep; travel limits keep the sum within an i32.
        [0, 1, 2].map(|i| {
            let microsteps = (i64::from(self.axes[i].fraction) + ahead[i]).div_euclid(i64::from(UNIT));
            positions[i] + microsteps as i32 * (16 / self.microsteps)
        })
    }

    /// Present motor rates, Q8 steps/s, rounded towards zero.
    pub fn rates(&self) -> [i32; 3] {
        self.turning.map(|rate| rate / self.per_q8())
    }

    /// Units of a pulse rate in 1/256 full step/s.
    fn per_q8(&self) -> i32 {
        self.microsteps << (RATE_BITS - 8)
    }

    /// A motor rate (Q8 full steps/s, within the limit) as a pulse rate. Microsteps are a power of two, and a shift is
    /// cheaper than a product that is checked: 31 bits by the build's highest pulse rate.
    fn per_second(&self, rate: i32) -> i32 {
        rate << (self.microsteps.trailing_zeros() + RATE_BITS - 8)
    }

    /// Whether any motor turns.
    pub fn moving(&self) -> bool {
        self.axes.iter().any(|a| a.rate != 0) || self.mean.moving()
    }

    /// Ticks that the motors need to change their rates by `changes`, the slowest of them.
    fn ticks_for(&self, changes: [i32; 3]) -> i32 {
        let ticks = |i: usize| match changes[i] {
            0 => 0,
            change => change.unsigned_abs().div_ceil(self.axes[i].delta.unsigned_abs()) as i32,
        };
        ticks(0).max(ticks(1)).max(ticks(2))
    }

    /// The pulse rates one tick on from the present ones towards `wanted`, with one common factor, in at least `ticks`.
    fn toward(&self, wanted: MotorRates, ticks: i32) -> [i32; 3] {
        // Within the limits, pulse rates are at most 1.28e9; the difference of two may take 32 bits and saturates.
        let changes = [0, 1, 2].map(|i| self.per_second(wanted.0[i]).saturating_sub(self.axes[i].rate));
        if changes == [0; 3] {
            return [0, 1, 2].map(|i| self.axes[i].rate);
        }
        let ticks = self.ticks_for(changes).max(ticks).max(1);
        // Away from zero, which still is at most `delta`, so that the last tick arrives exactly.
        [0, 1, 2].map(|i| {
            let step = changes[i].unsigned_abs().div_ceil(ticks.unsigned_abs()) as i32;
            self.axes[i].rate + if changes[i] < 0 { -step } else { step }
        })
    }

    /// The motor that would pass its travel at these rates for a tick and a ramp down after it.
    fn beyond_travel(&self, rates: [i32; 3]) -> Option<usize> {
        let (ticks, ahead) = (self.ticks_for(rates), self.mean.ahead());
        (0..3).find(|&i| !self.axes[i].can_stop(rates[i], ahead[i], ticks, self.microsteps))
    }

    /// Plans a tick towards the `wanted` rates (each within its motor's limit). Where a motor could then no longer
    /// stop within its travel, it plans a tick of ramping down instead and names that motor.
    pub fn tick(&mut self, wanted: MotorRates) -> (StepPlan, Option<usize>) {
        self.tick_over(wanted, 0)
    }

    /// As [`tick`](Self::tick), the change to the wanted rates spread over `ramp_us` at least.
    pub fn tick_over(&mut self, wanted: MotorRates, ramp_us: u32) -> (StepPlan, Option<usize>) {
        let mut rates = self.toward(wanted, (ramp_us / TICK_US) as i32);
        let beyond = self.beyond_travel(rates);
        if beyond.is_some() {
            rates = self.toward(MotorRates::default(), 0);
        }
        for (axis, rate) in self.axes.iter_mut().zip(rates) {
            axis.rate = rate;
        }
        self.turning = self.mean.tick(rates);
        let (microsteps, turning) = (self.microsteps, self.turning);
        let motors = [0, 1, 2].map(|i| self.axes[i].advance(turning[i], microsteps));
        self.history.tick(self.positions());
        (StepPlan { motors }, beyond)
    }
}
