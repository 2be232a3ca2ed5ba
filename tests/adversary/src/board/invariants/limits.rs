//! Limits of a configuration, in the units of the checkers.

use plumb_protocol::Config;
use plumb_protocol::config::{Deadlines, Motor, PathLimits};
use plumb_protocol::units::Steps16;

use super::super::event::TICK;

/// Duration of a cell of the moving average, ticks.
const CELL_TICKS: u64 = 16;

/// Fraction bits of the planner's pulse rates.
const RATE_BITS: u32 = 10;

/// Tolerance of a stop's duration, ticks: the current one, and rounding.
const STOP_SLACK: u64 = 3;

/// One motor's limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct MotorLimits {
    /// Configuration.
    pub(super) motor: Motor,
    /// 1/16 steps per pulse.
    pub(super) pulse: i32,
    /// Maximum number of pulses in a tick.
    pub(super) pulses: u16,
    /// Change of the planner's rate in a tick, rounded down: microsteps/s with 10 fraction bits.
    delta: u64,
    /// Units of the planner's rate in 1/256 step/s.
    units: u64,
}

impl MotorLimits {
    fn of(motor: Motor, microsteps: u8) -> Self {
        let microsteps = u64::from(microsteps);
        let pulse_rate_q8 = u64::from(motor.max_rate.0.unsigned_abs()) * microsteps;
        let per_second = (u64::from(motor.max_acceleration.0) * microsteps) << RATE_BITS;
        Self {
            motor,
            pulse: 16 / microsteps as i32,
            pulses: (pulse_rate_q8 * TICK / 256 / 1_000_000) as u16 + 1,
            delta: per_second * TICK / 1_000_000,
            units: microsteps << (RATE_BITS - 8),
        }
    }

    /// Returns the limits of a motor that the rig has not: it never turns, and may stand anywhere.
    fn absent() -> Self {
        let (travel_min, travel_max) = (Steps16(i32::MIN), Steps16(i32::MAX));
        let motor = Motor { travel_min, travel_max, ..Motor::default() };
        Self { motor, pulse: 1, pulses: 0, delta: 1, units: 0 }
    }

    /// Returns the ticks of a ramp to rest from `rate` (Q8 steps/s, rounded towards 0).
    fn ramp_ticks(&self, rate: u64) -> u64 {
        (rate + 1) * self.units / self.delta + 1
    }

    /// Returns whether a change of the rate by `change` (Q8 steps/s) within `ticks` is within the
    /// acceleration, with a tolerance of one unit of rounding.
    pub(super) fn allows(&self, change: u32, ticks: u64) -> bool {
        // 1 step/s² is 256 Q8 steps/s in 5000 ticks.
        let allowed = u64::from(self.motor.max_acceleration.0) * 256 * ticks;
        u64::from(change) * 5000 <= allowed + 5000
    }

    /// Returns the distance of `position` beyond the travel, 1/16 steps; 0 or less inside.
    pub(super) fn beyond(&self, position: i32) -> i64 {
        let position = i64::from(position);
        let (min, max) = (i64::from(self.motor.travel_min.0), i64::from(self.motor.travel_max.0));
        (min - position).max(position - max)
    }
}

/// Limits of a configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Limits {
    pub(super) motors: [MotorLimits; 3],
    /// Number of the motors that the rig has.
    pub(super) count: usize,
    pub(super) deadlines: Deadlines,
    pub(super) path: PathLimits,
    /// Maximum lag of the motors behind the setpoint, ticks.
    lag: u64,
}

impl Limits {
    pub(super) fn of(config: &Config) -> Self {
        let cells = u64::from(config.mean.0) * 1000 / (CELL_TICKS * TICK);
        Self {
            motors: config
                .motors
                .map(|motor| MotorLimits::of(motor, config.microsteps))
                .steppable(MotorLimits::absent()),
            count: config.motors.len(),
            deadlines: config.deadlines,
            path: config.path,
            // The cell that is filled, and the one in which the rates change.
            lag: if cells == 0 { 0 } else { (cells + 2) * CELL_TICKS },
        }
    }

    /// Returns the ticks of the longest stop from these rates (Q8 steps/s).
    pub(super) fn stop_ticks(&self, rates: [i32; 3]) -> u64 {
        if self.lag > 0 {
            // The moving average hides the rates of the ramp.
            return self.longest_stop();
        }
        let ramp = |i: usize| self.motors[i].ramp_ticks(rates[i].unsigned_abs().into());
        ramp(0).max(ramp(1)).max(ramp(2)) + STOP_SLACK
    }

    /// Returns the ticks of a stop from the maximum rates.
    pub(super) fn longest_stop(&self) -> u64 {
        let ramp = self.motors.map(|m| m.ramp_ticks(m.motor.max_rate.0.unsigned_abs().into()));
        ramp[0].max(ramp[1]).max(ramp[2]) + self.lag + STOP_SLACK
    }
}
