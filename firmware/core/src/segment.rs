//! From a tick's pulses to the two words that the step generator's program takes for it.
//!
//! The generator (firmware/src/generator.rs) runs the same program for each motor, a segment a tick:
//!
//! ```text
//! wait `first` -> pulse -> wait `period` -> pulse ... -> wait `rest` -> next segment
//! ```
//!
//! All segments together take as long as the ticks, to the clock, so that three motors and the board's timer stay in
//! step for ever. What a driver needs comes before the plan's moments: a pulse that would come too soon after the last
//! one, or after the direction line has changed, comes late, and the segment after it starts late by as much.

use plumb_protocol::config::StepDir;
use plumb_protocol::units::Nanoseconds;

use crate::plan::{CLOCK_HZ, Pulses, TICK_CLOCKS};

/// What a driver's inputs need, in clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Least time high, as the generator can do it. The direction is held for as long after a pulse begins.
    pub high: Width,
    /// Least time low between pulses.
    pub low: u32,
    /// Least time from a change of direction to the next pulse.
    pub setup: u32,
}

impl Timing {
    /// Slow enough for any driver: what holds before a driver is configured.
    pub const SLOWEST: Self = Self { high: Width { rounds: 31, delay: 15 }, low: 513, setup: 513 };

    /// The timing for a driver's data sheet; `None` where the generator cannot make pulses so wide.
    pub fn of(driver: &StepDir) -> Option<Self> {
        let clocks = |ns: Nanoseconds| (u32::from(ns.0) * (CLOCK_HZ / 1_000_000)).div_ceil(1000);
        let (low, setup) = (clocks(driver.low).max(LEAST_LOW), clocks(driver.setup));
        Some(Self { high: Width::at_least(clocks(driver.high))?, low, setup })
    }

    /// The least time from one pulse to the next, clocks.
    pub const fn least_period(&self) -> u32 {
        self.high.clocks() + self.low
    }

    /// The highest pulse rate, pulses/s. A clock is kept for the rounding of the plan's periods.
    pub const fn max_pulse_rate(&self) -> u32 {
        CLOCK_HZ / (self.least_period() + 1)
    }
}

/// A pulse's width: one clock and then a loop of up to 32 rounds of up to 16 clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Width {
    /// Rounds of the loop less one, 0..32: the operand of `set x`.
    pub rounds: u8,
    /// Clocks of a round less one, 0..16: the delay of `jmp x--`.
    pub delay: u8,
}

impl Width {
    /// The least width of at least `clocks`; `None` above 513.
    pub fn at_least(clocks: u32) -> Option<Self> {
        let looped = clocks.saturating_sub(1).max(1);
        (0..16u8)
            .filter_map(|delay| {
                let rounds = looped.div_ceil(u32::from(delay) + 1);
                (rounds <= 32).then_some(Self { rounds: (rounds - 1) as u8, delay })
            })
            .min_by_key(Self::clocks)
    }

    /// How long the pulse is high, clocks.
    pub const fn clocks(&self) -> u32 {
        1 + (self.rounds as u32 + 1) * (self.delay as u32 + 1)
    }
}

/// Clocks of the program from a segment's start to the first pulse, without waiting.
const TO_FIRST: u32 = 11;
/// From a segment's start until the direction line has its level.
const TO_DIRECTION: u32 = 4;
/// From the end of a pulse to the next pulse, without waiting.
const TO_NEXT: u32 = 4;
/// From the end of the last pulse to the next segment, without waiting.
const TO_END: u32 = 3;
/// From the start of a segment without pulses to the next segment, without waiting.
const EMPTY: u32 = 9;
/// From the end of a segment's last pulse to the next segment's first.
const LEAST_LOW: u32 = TO_END + TO_FIRST;

/// The segments of one motor, one after the other.
#[derive(Debug, Clone, Copy)]
pub struct Segments {
    timing: Timing,
    /// How late the next segment begins, clocks.
    late: u32,
    /// When the next pulse may come at the earliest, clocks from when the next segment ought to begin.
    ready: i32,
    direction: bool,
}

impl Segments {
    /// From standstill.
    pub fn new(timing: Timing) -> Self {
        Self { timing, late: 0, ready: 0, direction: false }
    }

    /// For another driver; at standstill.
    pub fn set_timing(&mut self, timing: Timing) {
        self.timing = timing;
    }

    /// What the generator was doing was cut off: the next segment begins when it ought to.
    pub fn restart(&mut self) {
        self.late = 0;
        self.ready = self.timing.least_period() as i32;
    }

    /// The words for the next tick.
    pub fn next(&mut self, pulses: &Pulses) -> [u32; 2] {
        if pulses.count == 0 { self.empty() } else { self.filled(pulses) }
    }

    fn empty(&mut self) -> [u32; 2] {
        let rest = TICK_CLOCKS.saturating_sub(self.late + EMPTY);
        self.finish(self.late + EMPTY + rest, 0);
        [Word { remaining: 0, wait: 0, direction: self.direction, any: false }.bits(), rest]
    }

    fn filled(&mut self, pulses: &Pulses) -> [u32; 2] {
        let Timing { high, low, setup } = self.timing;
        let high = high.clocks();
        let mut first = pulses.first.max(self.late + TO_FIRST).max(self.ready.max(0) as u32);
        if pulses.direction != self.direction {
            first = first.max(self.late + TO_DIRECTION + setup);
        }
        // 15 and 10 bits, said for the compiler: a product that may overflow is checked in 64 bits.
        let period = pulses.period.max(high + low).min(TICK_CLOCKS);
        let last = first + u32::from(pulses.count - 1).min(1023) * period;
        let end = last + high + TO_END;
        let rest = TICK_CLOCKS.saturating_sub(end);
        let wait = first - self.late - TO_FIRST;
        let word = Word {
            remaining: u32::from(pulses.count - 1),
            wait: period - high - TO_NEXT,
            direction: pulses.direction,
            any: true,
        };
        self.direction = pulses.direction;
        self.finish(end + rest, (last + high + low) as i32);
        [word.bits(), wait | rest << 16]
    }

    /// Takes note of when this segment ends and when a pulse may come again, clocks from when it ought to have begun.
    fn finish(&mut self, end: u32, ready: i32) {
        self.late = end - TICK_CLOCKS;
        self.ready = (ready.max(self.ready) - TICK_CLOCKS as i32).max(0);
    }
}

/// The first word of a segment, in the order in which the program takes it, lowest bits first.
struct Word {
    /// Pulses after the first: 10 bits.
    remaining: u32,
    /// Rounds of waiting between pulses: 16 bits.
    wait: u32,
    /// Level of the direction line: 1 bit.
    direction: bool,
    /// Whether there are pulses: 1 bit.
    any: bool,
}

impl Word {
    fn bits(&self) -> u32 {
        self.remaining | self.wait << 10 | u32::from(self.direction) << 26 | u32::from(self.any) << 27
    }
}

/// How many of a segment's `count` pulses were given, where it was stopped between pulses with `remaining` in the
/// program's counter (which goes below 0 after the last).
pub fn given(count: u16, remaining: u32) -> u16 {
    if count == 0 { 0 } else { (i32::from(count) - 1 - remaining as i32).clamp(0, i32::from(count)) as u16 }
}
