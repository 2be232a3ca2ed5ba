//! From a tick's pulses to the two words that the step generator's program takes for it.
//!
//! The generator (firmware/src/generator.rs) runs the same program for each motor, a segment a
//! tick:
//!
//! ```text
//! wait `first` -> pulse -> wait `period` -> pulse ... -> wait `rest` -> next segment
//! ```
//!
//! All segments together take as long as the ticks, to the clock, so that three motors and the
//! board's timer stay in step for ever. What a driver needs comes before the plan's moments: a
//! pulse that would come too soon after the last one, or after the direction line has changed,
//! comes late, and the segment after it starts late by as much.

use plumb_protocol::config::StepDir;
use plumb_protocol::units::Nanoseconds;

use crate::plan::{CLOCK_HZ, Pulses, TICK_CLOCKS};

/// What a driver's inputs need, in clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Least time high, as the generator can do it. The direction is held for as long after a pulse
    /// begins.
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
    /// Clocks of a pulse, from one to the next, and from a change of direction to one, at the
    /// least.
    high: u32,
    least: u32,
    setup: u32,
    /// How late the next segment begins, clocks.
    late: u32,
    /// When the next pulse may come at the earliest, clocks from when the next segment ought to
    /// begin.
    ready: u32,
    direction: bool,
    /// The plan's period last time, and what was made of it: the generator's, and the first word
    /// but for its count.
    planned: u32,
    period: u32,
    word: u32,
}

impl Segments {
    /// From standstill.
    pub fn new(timing: Timing) -> Self {
        let (direction, planned, period, word) = (false, 0, 0, 0);
        let mut segments = Self {
            high: 0,
            least: 0,
            setup: 0,
            late: 0,
            ready: TO_FIRST,
            direction,
            planned,
            period,
            word,
        };
        segments.set_timing(timing);
        segments
    }

    /// For another driver; at standstill.
    pub fn set_timing(&mut self, timing: Timing) {
        (self.high, self.least, self.setup) =
            (timing.high.clocks(), timing.least_period(), timing.setup);
        self.set_pulses(0, self.direction);
    }

    /// What the generator was doing was cut off: the next segment begins when it ought to.
    pub fn restart(&mut self) {
        self.late = 0;
        self.ready = self.least.max(TO_FIRST);
    }

    /// The words for the next tick.
    #[inline(never)]
    pub fn next(&mut self, pulses: &Pulses) -> (u32, u32) {
        if pulses.count == 0 {
            return self.empty();
        }
        if pulses.period != self.planned || pulses.direction != self.direction {
            self.set_pulses(pulses.period, pulses.direction);
        }
        let first = pulses.first.max(self.ready);
        // Not checked for overflow: 10 and 15 bits, and all else has less than 16.
        let remaining = u32::from(pulses.count.wrapping_sub(1)) & 1023;
        let wait = first.wrapping_sub(self.late).wrapping_sub(TO_FIRST);
        // The last pulse, clocks after the tick's end.
        let last = first.wrapping_add(remaining.wrapping_mul(self.period)).wrapping_sub(TICK_CLOCKS)
            as i32;
        // Behind `late` by TO_FIRST at least, since `least` is that more than a pulse.
        self.ready = last.wrapping_add(self.least as i32).max(TO_FIRST as i32) as u32;
        let end = last.wrapping_add((self.high + TO_END) as i32);
        self.late = end.max(0) as u32;
        (self.word | remaining, wait | end.min(0).unsigned_abs() << 16)
    }

    #[inline(never)]
    fn empty(&mut self) -> (u32, u32) {
        let end = self.late + EMPTY;
        let rest = TICK_CLOCKS.saturating_sub(end);
        self.late = end.saturating_sub(TICK_CLOCKS);
        self.ready = self.ready.saturating_sub(TICK_CLOCKS).max(self.late + TO_FIRST);
        (Word { wait: 0, direction: self.direction, any: false }.bits(), rest)
    }

    /// Goes over to pulses of this period and direction.
    #[inline(never)]
    fn set_pulses(&mut self, planned: u32, direction: bool) {
        if direction != self.direction {
            self.ready = self.ready.max(self.late + TO_DIRECTION + self.setup);
        }
        (self.planned, self.direction) = (planned, direction);
        self.period = planned.max(self.least).min(TICK_CLOCKS);
        self.word = Word { wait: self.period - self.high - TO_NEXT, direction, any: true }.bits();
    }
}

// What `Segments::next` builds on: a pulse that is soon enough after the last is soon enough after
// a late segment's beginning.
const _: () = assert!(LEAST_LOW >= TO_END + TO_FIRST);

/// The first word of a segment, in the order in which the program takes it, lowest bits first: 10
/// bits for the pulses after the first, and these.
struct Word {
    /// Rounds of waiting between pulses: 16 bits.
    wait: u32,
    /// Level of the direction line: 1 bit.
    direction: bool,
    /// Whether there are pulses: 1 bit.
    any: bool,
}

impl Word {
    fn bits(&self) -> u32 {
        self.wait << 10 | u32::from(self.direction) << 26 | u32::from(self.any) << 27
    }
}

/// How many of a segment's `count` pulses were given, where it was stopped between pulses with
/// `remaining` in the program's counter (which goes below 0 after the last).
pub fn given(count: u16, remaining: u32) -> u16 {
    if count == 0 {
        0
    } else {
        (i32::from(count) - 1 - remaining as i32).clamp(0, i32::from(count)) as u16
    }
}
