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
//! board's timer stay in step. The driver's minimum times take precedence over the plan: a pulse
//! that would come too soon after the last one, or after a change of the direction line, comes
//! late, and the next segment starts late by as much.

use crate::plan::Pulses;
use crate::timing::{DriverTiming, MIN_LOW, TICK_CLOCKS};

/// Clocks from a segment's start to its first pulse, without waiting.
const TO_FIRST: u32 = 11;
/// Clocks from a segment's start until the direction line has its level.
const TO_DIRECTION: u32 = 4;
/// Clocks from the end of a pulse to the next pulse, without waiting.
const TO_NEXT: u32 = 4;
/// Clocks from the end of the last pulse to the next segment, without waiting.
const TO_END: u32 = 3;
/// Clocks from the start of a segment without pulses to the next segment, without waiting.
const EMPTY: u32 = 9;

/// Segments of one motor, one after the other. Times in clocks.
#[derive(Debug, Clone, Copy)]
pub struct Segments {
    /// Width of a pulse.
    high: u32,
    /// Time from the end of a pulse for which the direction line stays.
    hold: u32,
    /// Least time from a pulse to the next.
    min_period: u32,
    /// Least time from a change of direction to a pulse.
    setup: u32,
    /// Delay of the next segment's start.
    late: u32,
    /// Earliest time of the next pulse, after the planned start of the next segment.
    ready: u32,
    /// Level of the direction line.
    direction: bool,
    /// Period of the last plan.
    planned: u32,
    /// The generator's period for it.
    period: u32,
    /// First word of a segment with that period, without its count.
    word: u32,
}

impl Segments {
    /// Creates the segments of a motor at standstill.
    pub fn new(timing: DriverTiming) -> Self {
        let mut segments = Self {
            high: 0,
            hold: 0,
            min_period: 0,
            setup: 0,
            late: 0,
            ready: TO_FIRST,
            direction: false,
            planned: 0,
            period: 0,
            word: 0,
        };
        segments.set_timing(timing);
        segments
    }

    /// Changes to another driver; at standstill.
    pub fn set_timing(&mut self, timing: DriverTiming) {
        self.high = timing.high.clocks();
        self.hold = timing.hold.saturating_sub(self.high);
        (self.min_period, self.setup) = (timing.min_period(), timing.setup);
        self.set_pulses(0, self.direction);
    }

    /// Starts afresh after the generator was stopped: the next segment begins on time.
    pub fn restart(&mut self) {
        self.late = 0;
        self.ready = self.min_period.max(TO_FIRST);
    }

    /// Returns the two words for the next tick.
    #[inline(never)]
    pub fn next(&mut self, pulses: &Pulses) -> (u32, u32) {
        if pulses.count == 0 {
            return self.empty();
        }
        if pulses.period != self.planned || pulses.direction != self.direction {
            self.set_pulses(pulses.period, pulses.direction);
        }
        let first = pulses.first.max(self.ready);
        // Not checked for overflow. Bits: count 10, period 15, all others less than 16.
        let remaining = u32::from(pulses.count.wrapping_sub(1)) & 1023;
        let wait = first.wrapping_sub(self.late).wrapping_sub(TO_FIRST);
        // Time of the last pulse after the tick's end; negative.
        let last = first.wrapping_add(remaining.wrapping_mul(self.period)).wrapping_sub(TICK_CLOCKS)
            as i32;
        // TO_FIRST after `late` at least, since `min_period` is that much longer than a pulse.
        self.ready = last.wrapping_add(self.min_period as i32).max(TO_FIRST as i32) as u32;
        let end = last.wrapping_add((self.high + TO_END) as i32);
        self.late = end.wrapping_add(self.hold as i32).max(0) as u32;
        // The next segment may change the direction line at once.
        let rest = self.late.wrapping_sub(end as u32);
        (self.word | remaining, wait | rest << 16)
    }

    /// Returns the words for a tick without pulses.
    #[inline(never)]
    fn empty(&mut self) -> (u32, u32) {
        let end = self.late + EMPTY;
        let rest = TICK_CLOCKS.saturating_sub(end);
        self.late = end.saturating_sub(TICK_CLOCKS);
        self.ready = self.ready.saturating_sub(TICK_CLOCKS).max(self.late + TO_FIRST);
        (Word { wait: 0, direction: self.direction, any: false }.bits(), rest)
    }

    /// Changes to pulses of this period and direction.
    #[inline(never)]
    fn set_pulses(&mut self, planned: u32, direction: bool) {
        if direction != self.direction {
            self.ready = self.ready.max(self.late + TO_DIRECTION + self.setup);
        }
        (self.planned, self.direction) = (planned, direction);
        self.period = planned.max(self.min_period).min(TICK_CLOCKS);
        self.word = Word { wait: self.period - self.high - TO_NEXT, direction, any: true }.bits();
    }
}

// `Segments::next` depends on this: a pulse that keeps its distance from the last one also keeps it
// from the beginning of a late segment.
const _: () = assert!(MIN_LOW == TO_END + TO_FIRST);

/// First word of a segment, in the order in which the program takes it, lowest bits first: 10 bits
/// for the pulses after the first, then these fields.
struct Word {
    /// Rounds of waiting between pulses: 16 bits.
    wait: u32,
    /// Level of the direction line: 1 bit.
    direction: bool,
    /// Whether there are pulses: 1 bit.
    any: bool,
}

impl Word {
    /// Returns the word without its count.
    fn bits(&self) -> u32 {
        self.wait << 10 | u32::from(self.direction) << 26 | u32::from(self.any) << 27
    }
}

/// Returns how many of a segment's `count` pulses were given when it stopped between pulses with
/// `remaining` in the program's counter (which goes below 0 after the last).
pub fn given(count: u16, remaining: u32) -> u16 {
    if count == 0 {
        0
    } else {
        (i32::from(count) - 1 - remaining as i32).clamp(0, i32::from(count)) as u16
    }
}
