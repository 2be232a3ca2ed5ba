//! From wanted motor rates to pulses: ramps within the limits, exact step counts, no motor past its travel.
//!
//! Time goes in ticks of [`TICK_US`]. In a tick each motor turns at a constant rate; between ticks the rates move
//! towards the wanted ones with one common factor, so that the path in motor space bends as little as it can.

mod jog;

use plumb_protocol::config::Motor;

use crate::law::MotorRates;
use crate::params::Params;
pub use jog::Jogging;

/// Length of a tick, microseconds.
pub const TICK_US: u32 = 1000;

const TICK_NS: u64 = TICK_US as u64 * 1000;

/// One microstep in units of the reference: a rate of one unit (1/256 step/s) moves it by `microsteps` units a tick.
const UNIT: i32 = 256 * (1_000_000 / TICK_US as i32);

/// What one motor does in a tick: `count` pulses, the k-th `first_ns + k * period_ns` after the tick's start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pulses {
    /// Level of the direction line: high where the cable is paid out, unless the motor is reversed.
    pub direction: bool,
    /// Number of pulses (microsteps).
    pub count: u16,
    /// When the first comes, ns after the tick's start; below the tick's length.
    pub first_ns: u32,
    /// From one to the next, ns; at most the tick's length.
    pub period_ns: u32,
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
}

#[derive(Debug, Clone, Copy)]
struct Axis {
    /// Highest change of rate a tick, Q8 steps/s, at least 2.
    delta: i32,
    /// Travel, 1/16 steps.
    travel: (i32, i32),
    reversed: bool,
    /// Present rate, Q8 steps/s.
    rate: i32,
    /// Pulses given, 1/16 steps.
    position: i32,
    /// How far the reference is beyond the last pulse: [0, UNIT).
    fraction: i32,
}

impl Axis {
    const AT_REST: Self =
        Self { delta: 2, travel: (0, 0), reversed: false, rate: 0, position: 0, fraction: UNIT / 2 };

    fn configure(&mut self, motor: &Motor) {
        // a·tick in Q8, rounded down: 4e6 steps/s² are 1 024 000, 20 bits; the product 43.
        let delta = (u64::from(motor.max_acceleration.0) * 256 * u64::from(TICK_US)) / 1_000_000;
        *self = Self {
            delta: delta as i32,
            travel: (motor.travel_min.0, motor.travel_max.0),
            reversed: motor.reversed,
            fraction: UNIT / 2,
            ..*self
        };
    }

    /// Whether the motor stays within its travel if it turns at `rate` for this tick and then stops over `ticks`.
    fn can_stop(&self, rate: i32, ticks: i32, microsteps: i32) -> bool {
        // This tick at `rate`, then rate·(1 - k/ticks) for k = 1.. : rate·(ticks + 1)/2 in all. Bits: rate·microsteps
        // 31, ticks 22.
        let units = i64::from(rate) * i64::from(microsteps) * (i64::from(ticks) + 1) / 2;
        let pulses = (i64::from(self.fraction) + units).div_euclid(i64::from(UNIT));
        let end = i64::from(self.position) + pulses * i64::from(16 / microsteps);
        match rate.signum() {
            1 => end <= i64::from(self.travel.1),
            -1 => end >= i64::from(self.travel.0),
            _ => true,
        }
    }

    /// Moves the reference by a tick at the present rate; the pulses that it passes.
    fn advance(&mut self, microsteps: i32) -> Pulses {
        // UNIT is 18 bits; rate·microsteps at most 2^31 by the build's pulse rate, so i64 for the sum.
        let moved = i64::from(self.rate) * i64::from(microsteps);
        let (unit, distance) = (i64::from(UNIT), moved.unsigned_abs());
        let reference = i64::from(self.fraction) + moved;
        let pulses = reference.div_euclid(unit);
        // Units to before the first pulse: the rest of this microstep upwards, what was passed of it downwards; so all
        // pulses lie before the tick's end.
        let to_first = if moved > 0 { UNIT - 1 - self.fraction } else { self.fraction };
        self.fraction = reference.rem_euclid(unit) as i32;
        self.position += pulses as i32 * (16 / microsteps);
        let forward = moved > 0;
        if pulses == 0 {
            return Pulses { direction: forward != self.reversed, ..Pulses::default() };
        }
        Pulses {
            direction: forward != self.reversed,
            count: pulses.unsigned_abs() as u16,
            first_ns: ((to_first as u64 * TICK_NS) / distance) as u32,
            period_ns: ((UNIT as u64 * TICK_NS) / distance).min(TICK_NS) as u32,
        }
    }
}

impl Default for Planner {
    fn default() -> Self {
        Self { axes: [Axis::AT_REST; 3], microsteps: 16 }
    }
}

impl Planner {
    /// Takes over the motors' limits; call at standstill. Positions go on.
    pub fn configure(&mut self, params: &Params) {
        self.microsteps = i32::from(params.microsteps);
        for (axis, motor) in self.axes.iter_mut().zip(&params.motors) {
            axis.configure(motor);
        }
    }

    /// Motor positions in 1/16 steps since the start: what was pulsed, to the end of the last tick.
    pub fn positions(&self) -> [i32; 3] {
        self.axes.map(|a| a.position)
    }

    /// Present motor rates, Q8 steps/s.
    pub fn rates(&self) -> [i32; 3] {
        self.axes.map(|a| a.rate)
    }

    /// Whether any motor turns.
    pub fn moving(&self) -> bool {
        self.axes.iter().any(|a| a.rate != 0)
    }

    /// Ticks that the motors need to change their rates by `changes`, the slowest of them.
    fn ticks_for(&self, changes: [i32; 3]) -> i32 {
        let ticks = |i: usize| changes[i].unsigned_abs().div_ceil(self.axes[i].delta.unsigned_abs()) as i32;
        ticks(0).max(ticks(1)).max(ticks(2))
    }

    /// The rates one tick on from the present ones towards `wanted`, with one common factor.
    fn toward(&self, wanted: MotorRates) -> [i32; 3] {
        // Rates are at most 2^30 (pulse rate of the build), so the difference fits.
        let changes = [0, 1, 2].map(|i| wanted.0[i] - self.axes[i].rate);
        let ticks = self.ticks_for(changes).max(1);
        // Away from zero, which still is at most `delta`, so that the last tick arrives exactly.
        [0, 1, 2].map(|i| {
            let step = changes[i].unsigned_abs().div_ceil(ticks.unsigned_abs()) as i32;
            self.axes[i].rate + changes[i].signum() * step
        })
    }

    /// The motor that would pass its travel at these rates for a tick and a ramp down after it.
    fn beyond_travel(&self, rates: [i32; 3]) -> Option<usize> {
        let ticks = self.ticks_for(rates);
        (0..3).find(|&i| !self.axes[i].can_stop(rates[i], ticks, self.microsteps))
    }

    /// Plans a tick towards the `wanted` rates (each within its motor's limit). Where a motor could then no longer
    /// stop within its travel, it plans a tick of ramping down instead and names that motor.
    pub fn tick(&mut self, wanted: MotorRates) -> (StepPlan, Option<usize>) {
        let mut rates = self.toward(wanted);
        let beyond = self.beyond_travel(rates);
        if beyond.is_some() {
            rates = self.toward(MotorRates::default());
        }
        for (axis, rate) in self.axes.iter_mut().zip(rates) {
            axis.rate = rate;
        }
        let microsteps = self.microsteps;
        let [a, b, c] = &mut self.axes;
        (StepPlan { motors: [a, b, c].map(|axis| axis.advance(microsteps)) }, beyond)
    }
}
