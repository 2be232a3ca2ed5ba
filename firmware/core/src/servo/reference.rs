//! The reference that the ball follows: where it is to be, from a moment ago to what the motors are
//! told next.
//!
//! ```text
//! Reference (knots) -> Path -> the path's time, at a pace -> a point that chases it -> track
//! ```
//!
//! The reference is made ahead of time, since the law and the moving average of the step plan need
//! it as much ahead. It moves within the configured limits, whatever the host sends: it is a point
//! that chases the path's.

mod clock;
mod path;
#[cfg(test)]
mod tests;

use clock::{Conditions, PathClock, STEP_BITS, STEP_S, STEP_US};
use path::{Motion, MotionLimits, Path};
use plumb_protocol::message::{self, ReferenceState};
use plumb_protocol::units::{Micrometres, Micros, Point};

use crate::law::Aim;
use crate::params::Params;
use crate::plan::mean_lag_us;
use crate::vector::{length, per_axis, plus};

/// Least time between the ticks that make states, µs: a path that begins needs many at once, and
/// the chip has other work.
const LEAST_GAP_US: u64 = 400;
/// Time by which a state may be late before it is made in a tick with other work, µs.
const MAX_LATE_US: u64 = 4_000;

/// Time of a frame at 30 Hz, µs: so long a law's rates hold.
const FRAME_US: u64 = 33_333;
/// Time beyond the lead for which the reference is made, µs: the law's answer takes effect 20 ms
/// after its request, and holds for a frame.
const BEYOND_US: u64 = 20_000 + FRAME_US;

/// Least pace for which the motors' room counts: a path of which they can keep less stands.
const MIN_LAW_PACE: f32 = 0.02;

/// The reference of a drive that follows a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ReferenceTracker {
    path: Path,
    clock: PathClock,
    /// Newest state of the reference.
    motion: Motion,
    /// What is done of the next one.
    work: Work,
    track: Track,
    /// When the next state may be made.
    not_before: Micros,
    /// Number of the last message.
    sequence: u16,
    /// Pace that the motors can keep.
    law_pace: f32,
    /// The reference at the captures, filtered as the ball's positions are: µm with 4 fraction
    /// bits.
    smoothed: [i32; 3],
}

/// What is done of the next state. It is made in three parts: a tick of the chip has no time for
/// all of them.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Work {
    /// Nothing.
    None,
    /// The path's motion at its time, at the host's pace.
    Path(Motion),
    /// What the reference is to chase.
    Leader {
        /// The path's motion at its pace.
        motion: Motion,
        /// See [`PathClock::closing`].
        closing: f32,
    },
}

/// Converts µm to mm.
fn millimetres(micrometres: [i32; 3]) -> [f32; 3] {
    micrometres.map(|p| p as f32 * 1e-3)
}

/// Converts Q4 µm to µm.
fn micrometres(q4: [i32; 3]) -> [i32; 3] {
    q4.map(|p| p.saturating_add(8) >> 4)
}

impl Motion {
    /// Returns the motion's place on the track.
    fn state(&self, clock: &PathClock) -> State {
        // The cast saturates.
        State { position: self.position.map(|p| (p * 16_000.0) as i32), time: clock.time() }
    }
}

impl ReferenceTracker {
    /// Creates the reference at rest at `start` (µm), from where it goes to the path.
    pub(super) fn new(now: Micros, start: [i32; 3], reference: &message::Reference) -> Self {
        let motion = Motion { position: millimetres(start), ..Motion::default() };
        let clock = PathClock::new(now, reference);
        Self {
            path: Path::new(reference),
            motion,
            work: Work::None,
            track: Track::new(now, motion.state(&clock)),
            clock,
            not_before: now,
            sequence: reference.sequence,
            law_pace: 1.0,
            smoothed: start.map(|p| p << 4),
        }
    }

    /// Takes over the next part of the path. Returns whether it is newer than the last one.
    pub(super) fn update(&mut self, now: Micros, reference: &message::Reference) -> bool {
        let is_newer = reference.sequence.wrapping_sub(self.sequence) as i16 > 0;
        if is_newer {
            self.sequence = reference.sequence;
            self.path = Path::new(reference);
            self.clock.update(now, reference);
        }
        is_newer
    }

    /// Takes over what the law says of the motors' room; see [`crate::law::Setpoint::room`].
    pub(super) fn set_room(&mut self, room: u16) {
        // At rest the law does not know the room, and the last one counts.
        if room > 0 {
            // The rates that the law knows of belong to the present pace.
            let pace = self.clock.pace() * f32::from(room) / 256.0;
            self.law_pace = pace.clamp(MIN_LAW_PACE, 1.0);
        }
    }

    /// Returns when the next state is to be made, for a reference that is `lead_us` ahead.
    pub(super) fn next_step(&self, lead_us: u64) -> Micros {
        self.track.end().back(lead_us + BEYOND_US).max(self.not_before)
    }

    /// Returns whether the next state is so late that it is to be made in any tick.
    pub(super) fn is_late(&self, now: Micros, lead_us: u64) -> bool {
        now.since(self.next_step(lead_us)) > MAX_LATE_US
    }

    /// Makes a part of the next state, in the tick at `now`. `deviation` is the filtered distance
    /// of the ball from the reference, µm; `None` where the ball is not seen.
    pub(super) fn step(&mut self, now: Micros, deviation: Option<u32>, params: &Params) {
        self.not_before = Micros(now.0 + LEAST_GAP_US);
        self.work = match self.work {
            Work::None => Work::Path(self.path.at(self.clock.time())),
            Work::Path(leader) => self.lead(&leader, deviation, params),
            Work::Leader { motion, closing } => {
                let limits = MotionLimits::new(&params.config.path);
                self.motion = self.motion.chasing(&motion, &limits, closing, STEP_S);
                self.track.push(self.motion.state(&self.clock));
                Work::None
            }
        }
    }

    /// Advances the path's time by a step, after the path's motion `leader` at its start.
    fn lead(&mut self, leader: &Motion, deviation: Option<u32>, params: &Params) -> Work {
        let conditions = Conditions {
            deviation,
            limit: params.config.path.deviation.0.unsigned_abs(),
            law_pace: self.law_pace,
            speed: length(leader.velocity),
            distance: length(plus(leader.position, self.motion.position, -1.0)),
        };
        let pace = self.clock.pace();
        self.clock.step(self.track.end(), &self.path, &conditions);
        let motion = leader.paced(pace, (self.clock.pace() - pace) / STEP_S);
        Work::Leader { motion, closing: self.clock.closing(&conditions) }
    }

    /// Returns the position of the reference at `time`, µm.
    pub(super) fn position(&self, time: Micros) -> [i32; 3] {
        micrometres(self.track.position(time))
    }

    /// Returns the aim of a law whose rates take effect at `time`, at rest: for laws that do not
    /// use the velocity.
    pub(super) fn place(&self, time: Micros, params: &Params) -> Aim {
        let time = Micros(time.0 + mean_lag_us(params.config.mean.0));
        Aim { position: self.position(time), velocity: [0; 3] }
    }

    /// Returns the aim of a law whose rates take effect at `time`.
    pub(super) fn aim(&self, time: Micros, params: &Params) -> Aim {
        let time = Micros(time.0 + mean_lag_us(params.config.mean.0));
        let now = self.track.position(time);
        let then = self.track.position(Micros(time.0 + FRAME_US));
        let velocity = per_axis(|i| {
            // 30 a second, from Q4.
            let moved = then[i].saturating_sub(now[i]).clamp(-(1 << 27), 1 << 27);
            moved * 15 / 8
        });
        Aim { position: micrometres(now), velocity }
    }

    /// Filters the reference of a position that was `captured` then, as
    /// [`BallTracker`](super::BallTracker) filters the position.
    pub(super) fn smooth(&mut self, captured: Micros) {
        let reference = self.position(captured);
        self.smoothed =
            per_axis(|i| self.smoothed[i] + (((reference[i] << 4) - self.smoothed[i]) >> 2));
    }

    /// Returns the filtered reference.
    pub(super) fn smoothed(&self) -> Point {
        Point(self.smoothed.map(|p| Micrometres((p + 8) >> 4)))
    }

    /// Returns whether at `time` the path had ended, and the reference rests at its end. The newest
    /// states are ahead of the present: they may rest while the ball still follows.
    pub(super) fn has_arrived(&self, time: Micros) -> bool {
        self.path.rests_from(self.track.path_time(time))
            && self.motion.velocity.iter().all(|v| v.abs() < 0.1)
    }

    /// Returns the last place of the path that is known.
    pub(super) fn last(&self) -> Point {
        self.path.last()
    }

    /// Returns the state for telemetry.
    pub(super) fn state(&self, now: Micros) -> ReferenceState {
        ReferenceState {
            sequence: self.sequence,
            time: Micros(self.track.path_time(now).max(0) as u64),
            pace: (self.clock.pace() * 256.0 + 0.5) as u16,
            position: Point(self.position(now).map(Micrometres)),
        }
    }
}

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
        per_axis(|i| {
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
