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

use crate::clock::TICK_CLOCKS;
use crate::driver_timing::{DriverTiming, MIN_LOW};
use crate::plan::Pulses;

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
    pub fn new(timing: DriverTiming) -> Self {
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
    pub fn set_timing(&mut self, timing: DriverTiming) {
        (self.high, self.least, self.setup) =
            (timing.high.clocks(), timing.min_period(), timing.setup);
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

// `Segments::next` depends on this: a pulse that keeps its distance from the last one also keeps it
// from the beginning of a late segment.
const _: () = assert!(MIN_LOW == TO_END + TO_FIRST);

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
