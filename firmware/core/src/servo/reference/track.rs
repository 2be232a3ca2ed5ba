//! The reference over time, from half a second ago to what was made ahead.

use plumb_protocol::units::Micros;

use super::{STEP_BITS, STEP_US};

/// States kept: half a second.
const STATES: usize = 32;

/// The reference at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    /// Position, Q4 µm: ±134 m.
    pub(super) position: [i32; 3],
    /// The path's time, µs.
    pub(super) time: i64,
}

/// States of the reference at even intervals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Track {
    states: [State; STATES],
    /// Index of the newest state.
    newest: usize,
    /// Moment of the newest state.
    end: Micros,
}

impl Track {
    /// Creates a track that rests in `state` until `now`.
    pub(super) fn new(now: Micros, state: State) -> Self {
        Self { states: [state; STATES], newest: 0, end: now }
    }

    /// Returns the moment of the newest state.
    pub(super) fn end(&self) -> Micros {
        self.end
    }

    /// Adds the state an interval after the newest one.
    pub(super) fn push(&mut self, state: State) {
        self.newest = (self.newest + 1) % STATES;
        self.states[self.newest] = state;
        self.end = Micros(self.end.0 + u64::from(STEP_US));
    }

    /// Returns the position at `time`, Q4 µm, interpolated; the oldest or the newest one beyond
    /// them.
    pub(super) fn position(&self, time: Micros) -> [i32; 3] {
        let Between { from, to, share } = self.around(time);
        [0, 1, 2].map(|i| {
            let (from, to) = (from.position[i], to.position[i]);
            to.wrapping_add(part_of(from.wrapping_sub(to), share))
        })
    }

    /// Returns the path's time at `time`, µs, interpolated likewise.
    pub(super) fn path_time(&self, time: Micros) -> i64 {
        let Between { from, to, share } = self.around(time);
        let back = (from.time - to.time).clamp(-(1 << 30), 1 << 30);
        to.time + (back.wrapping_mul(share.into()) >> 16)
    }

    /// Returns the states around `time`.
    fn around(&self, time: Micros) -> Between<'_> {
        let before = self.end.since(time).min(u64::from(u32::MAX)) as u32;
        let (steps, part) = ((before / STEP_US) as usize, before % STEP_US);
        let state = |back: usize| &self.states[(self.newest + STATES - back) % STATES];
        if steps + 1 >= STATES {
            let oldest = state(STATES - 1);
            return Between { from: oldest, to: oldest, share: 0 };
        }
        let share = part << (16 - STEP_BITS);
        Between { from: state(steps + 1), to: state(steps), share }
    }
}

/// Two states, and a moment between them.
struct Between<'a> {
    from: &'a State,
    to: &'a State,
    /// Time from the moment to the later state over the time between them, Q16, below 1.
    share: u32,
}

/// Returns `share` (Q16, below 1) of `value`, rounded down. The halves of the value take the chip
/// two products of 32 bits, which are faster than one of 64 bits.
fn part_of(value: i32, share: u32) -> i32 {
    let (high, low) = (value >> 16, value as u32 & 0xffff);
    high.wrapping_mul(share as i32).wrapping_add((low.wrapping_mul(share) >> 16) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_that_of_exact_arithmetic() {
        for value in [0, 1, -1, 0xffff, -0x10000, 0x1_2345, -0x765_4321, i32::MAX, i32::MIN] {
            for share in [0, 1, 0x8000, 0xabcd, 0xffff] {
                let exact = (i64::from(value) * i64::from(share)) >> 16;
                assert_eq!(i64::from(part_of(value, share)), exact, "{value} {share}");
            }
        }
    }

    #[test]
    fn a_track_is_linear_between_its_states_and_rests_beyond_them() {
        let state = |k: i32| State { position: [1600 * k, 0, -800 * k], time: 1000 * i64::from(k) };
        let begin = 1_000_000;
        let mut track = Track::new(Micros(begin), state(0));
        (1..=40).for_each(|k| track.push(state(k)));
        let end = begin + 40 * u64::from(STEP_US);
        assert_eq!(track.end(), Micros(end));
        let at = |us: u64| {
            let time = Micros(us);
            State { position: track.position(time), time: track.path_time(time) }
        };
        assert_eq!(at(end), state(40));
        assert_eq!(at(u64::MAX), state(40));
        let half = end - u64::from(STEP_US) / 2;
        assert_eq!(at(half), State { position: [63_200, 0, -31_600], time: 39_500 });
        assert_eq!(at(end - 30 * u64::from(STEP_US)), state(10));
        let beyond = end - 31 * u64::from(STEP_US) - u64::from(STEP_US) / 2;
        assert_eq!([at(beyond), at(0)], [state(9); 2]);
    }

    /// A path that is late beyond its limit jumps back.
    #[test]
    fn the_time_of_a_path_may_go_back() {
        let state = |time| State { position: [0; 3], time };
        let mut track = Track::new(Micros(0), state(9_000));
        track.push(state(1_000));
        assert_eq!(track.path_time(Micros(u64::from(STEP_US) / 2)), 5_000);
    }
}
