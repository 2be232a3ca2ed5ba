//! The reference over time, from half a second ago to what was made ahead.

use plumb_protocol::units::Micros;

use super::STEP_US;
use crate::vector::{Vector, plus};

/// States kept: half a second.
const STATES: usize = 32;

/// The reference at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    /// Position, mm.
    pub(super) position: Vector,
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

    /// Returns the state at `time`, interpolated; the oldest or the newest one beyond them.
    pub(super) fn at(&self, time: Micros) -> State {
        let before = self.end.since(time).min(u64::from(u32::MAX)) as u32;
        let (steps, part) = ((before / STEP_US) as usize, before % STEP_US);
        let state = |back: usize| self.states[(self.newest + STATES - back) % STATES];
        if steps + 1 >= STATES {
            return state(STATES - 1);
        }
        let (from, to) = (state(steps + 1), state(steps));
        let share = part as f32 / STEP_US as f32;
        let back = plus(from.position, to.position, -1.0);
        let time = (to.time - from.time).clamp(-(1 << 30), 1 << 30) as f32;
        State { position: plus(to.position, back, share), time: to.time - (time * share) as i64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_is_linear_between_its_states_and_rests_beyond_them() {
        let state = |k: i64| State { position: [k as f32, 0.0, -k as f32], time: 1000 * k };
        let mut track = Track::new(Micros(1_000_000), state(0));
        (1..=40).for_each(|k| track.push(state(k)));
        assert_eq!(track.end(), Micros(1_640_000));
        let at = |us: u64| track.at(Micros(us));
        assert_eq!(at(1_640_000), state(40));
        assert_eq!(at(u64::MAX), state(40));
        assert_eq!(at(1_632_000), State { position: [39.5, 0.0, -39.5], time: 39_500 });
        assert_eq!(at(1_160_000), state(10));
        assert_eq!(at(0), state(9));
    }
}
