//! The planner's output and the units that it counts in.

use crate::clock::TICK_US;

/// Fraction bits of a pulse rate (microsteps/s). With 10 of them, small accelerations still change
/// the rate in a tick.
pub(super) const RATE_BITS: u32 = 10;

/// One microstep in units of the reference, 23 bits. A pulse rate moves the reference by itself
/// every tick.
pub(super) const UNIT: i32 = (1_000_000 / TICK_US as i32) << RATE_BITS;

/// Pulses of one motor in a tick: `count` pulses, the k-th `first + k * period` clocks after the
/// tick's start, all before its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pulses {
    /// Level of the direction line: high where the cable is paid out, unless the motor is reversed.
    pub direction: bool,
    /// Number of pulses (microsteps).
    pub count: u16,
    /// Time of the first pulse, clocks after the tick's start.
    pub first: u32,
    /// Time from one pulse to the next, clocks; at most a tick.
    pub period: u32,
}

impl Pulses {
    /// No pulses.
    pub(super) const NONE: Self = Self { direction: false, count: 0, first: 0, period: 0 };
}

/// Pulses of the three motors in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StepPlan {
    /// Motors A, B and C.
    pub motors: [Pulses; 3],
}
