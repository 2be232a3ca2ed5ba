//! The guards of a drive, which compare the ball's way with its target and with the motors: an
//! error that grows, motors that turn without the ball, and a ball that gets no nearer to its
//! target.

use plumb_protocol::config::{Following, Growth, Progress};
use plumb_protocol::dimension::{PerAxis, PerMotor};
use plumb_protocol::message::Fault;
use plumb_protocol::units::{Micros, Point};

use super::tracker::{error, magnitude};
use crate::params::Params;
use crate::plan::RunOut;
use crate::vector::{per_axis, per_motor};
use crate::wide::signed_product;

/// Guards that compare the ball's way with its target and with the motors. They outlive a change of
/// the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Guards {
    divergence: DivergenceGuard,
    motion_without_ball: MotionWithoutBallGuard,
    progress: ProgressGuard,
}

/// State of a drive after a position.
#[derive(Debug, Clone, Copy)]
pub struct DriveState {
    /// When the frame of the position was captured.
    pub captured: Micros,
    /// Filtered position of the ball, µm.
    pub ball: PerAxis<i32>,
    /// The target.
    pub target: Point,
    /// Distance between the two, µm.
    pub error: u32,
    /// The motors.
    pub motors: MotorsOfDrive,
}

/// Motor positions of a drive after a position, Q4 steps.
#[derive(Debug, Clone, Copy)]
pub struct MotorsOfDrive {
    /// Present ones.
    pub present: PerMotor<i32>,
    /// Those when the frame of the position was captured.
    pub at_capture: PerMotor<i32>,
}

impl DriveState {
    /// Creates the state with its error.
    pub fn new(captured: Micros, ball: PerAxis<i32>, target: Point, motors: MotorsOfDrive) -> Self {
        Self { captured, ball, target, error: magnitude(error(ball, target)), motors }
    }
}

impl Guards {
    /// Begins anew, for the next drive.
    pub(super) fn reset(&mut self) {
        self.divergence.reset();
        self.motion_without_ball = MotionWithoutBallGuard::default();
        self.progress = ProgressGuard::default();
    }

    /// Returns the target of the last position; `None` before the first one.
    pub(super) fn last_target(&self) -> Option<Point> {
        self.divergence.last_target()
    }

    /// Notes at `now` that the target is replaced to which the ball had `way` to go (µm), while the
    /// motors come to rest by `run_out` without a new setpoint.
    pub fn note_change(&mut self, now: Micros, way: PerAxis<i32>, run_out: &RunOut) {
        self.divergence.note_change(now, way, run_out);
    }

    /// Takes in the state after a position. Returns the fault that stops the drive; call once for
    /// each position.
    pub fn update(&mut self, now: Micros, state: &DriveState, params: &Params) -> Option<Fault> {
        let DriveState { ball, target, error, motors, .. } = *state;
        let here = Nearest { position: ball, target, error };
        let radius = params.config.reached.radius.0.unsigned_abs();
        let diverged = self.divergence.update(now, state, &params.config.growth);
        let left_behind =
            self.motion_without_ball.update(ball, motors.present, &params.config.following);
        let stuck = self.progress.update(now, here, radius, &params.config.progress);
        match (diverged, left_behind, stuck) {
            (true, ..) => Some(Fault::ErrorGrowing),
            (_, true, _) => Some(Fault::NotFollowing),
            (.., true) => Some(Fault::NoProgress),
            _ => None,
        }
    }
}

/// Guard against an error that stays above its smallest value so far: the ball is driven away from
/// its target.
///
/// The guard keeps the nearest position so far and measures its error from the present target.
/// Therefore a change of the target neither disarms the guard nor trips it, however often targets
/// come. In a [run-out](RunOuts) the error grows without a fault: there the present position
/// counts as the nearest one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct DivergenceGuard {
    /// The nearest position, seen from the target of the last position.
    nearest: Option<Nearest>,
    /// When the error began to stay above the margin.
    since: Option<Micros>,
    run_outs: RunOuts,
}

impl DivergenceGuard {
    /// Begins anew, for the next drive.
    fn reset(&mut self) {
        (self.nearest, self.since) = (None, None);
        self.run_outs.clear();
    }

    /// Returns the target of the last position; `None` before the first one.
    fn last_target(&self) -> Option<Point> {
        self.nearest.map(|nearest| nearest.target)
    }

    /// Notes that the target is replaced; see [`RunOuts::note`].
    fn note_change(&mut self, now: Micros, way: PerAxis<i32>, run_out: &RunOut) {
        self.run_outs.note(now, way, run_out);
    }

    /// Takes in the present position. Returns whether the error has been above its smallest value
    /// and the rule's margin for the rule's time.
    fn update(&mut self, now: Micros, state: &DriveState, rule: &Growth) -> bool {
        let here = Nearest { position: state.ball, target: state.target, error: state.error };
        let before = self.nearest.map_or(here, |nearest| nearest.seen_from(here.target));
        let moved = per_axis(|i| here.position[i] - before.position[i]);
        let runs_out = self.run_outs.update(state.captured, state.motors.at_capture, moved);
        let nearest = if here.error <= before.error || runs_out { here } else { before };
        self.nearest = Some(nearest);
        if here.error <= nearest.error.saturating_add(rule.margin.0.unsigned_abs()) {
            self.since = None;
            return false;
        }
        let since = *self.since.get_or_insert(now);
        now.since(since) >= u64::from(rule.time.0) * 1000
    }
}

/// Run-outs that are kept at most.
const RUN_OUTS: usize = 8;

/// Least time from one run-out that is kept to the next, µs. A target that was in force for less
/// moves the ball by little.
const SPACING_US: u64 = 150_000;

/// Positions that are taken in after the end of a run-out until the filtered position has left
/// it: the filter, which goes a quarter of the way with each, is then within a tenth of its lag.
const POSITIONS: u8 = 8;

/// Turn of a motor below which it stands, Q4 steps: a full step.
const STANDS: u32 = 16;

/// Way that the ball still goes after a change of its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct BallRunOut {
    /// When no setpoint for the old target turns the motors any more.
    until: Micros,
    /// From the ball to its old target, µm.
    ball: PerAxis<i32>,
    /// From the filtered motor positions to those at which the motors come to rest without a new
    /// setpoint, Q4 steps.
    motors: PerMotor<i32>,
    /// Positions captured after `until` that are still to come; 0 for a way that has ended.
    left: u8,
}

/// Run-outs of a drive.
///
/// A change of the target changes the setpoint at once and the motors later: they ramp within
/// their acceleration, and follow the moving average of the step plan. The ball goes on, and its
/// filtered position follows some pictures later. The ball is in a run-out while it moves towards
/// the old target, the motors turn as their old setpoints have them turn, and these setpoints
/// still have an effect. A ball that its motors drive away from every target is on none of them,
/// however often targets come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct RunOuts {
    ways: [BallRunOut; RUN_OUTS],
    /// Index of the oldest one.
    oldest: usize,
    /// When the newest one was noted.
    since: Option<Micros>,
    /// Motor positions at the captures, filtered as the ball's are: Q4 steps; `None` before the
    /// first position.
    motors: Option<PerMotor<i32>>,
}

impl RunOuts {
    /// Forgets all run-outs. (In place: to copy a new value takes the stepping interrupt longer.)
    fn clear(&mut self) {
        self.ways.iter_mut().for_each(|way| way.left = 0);
        (self.since, self.motors) = (None, None);
    }

    /// Notes at `now` that the target is replaced to which the ball had `way` to go (µm), while the
    /// motors come to rest by `run_out` without a new setpoint.
    fn note(&mut self, now: Micros, way: PerAxis<i32>, run_out: &RunOut) {
        let Some(motors) = self.motors else { return };
        let turn = per_motor(|i| run_out.motors[i].saturating_sub(motors[i]));
        let is_close = self.since.is_some_and(|since| now.since(since) < SPACING_US);
        if is_close || turn.iter().all(|turn| turn.unsigned_abs() < STANDS) {
            return;
        }
        self.since = Some(now);
        let until = Micros(now.0 + run_out.time_us);
        self.ways[self.oldest] = BallRunOut { until, ball: way, motors: turn, left: POSITIONS };
        self.oldest = (self.oldest + 1) % RUN_OUTS;
    }

    /// Takes in the motor positions (Q4 steps) at the capture of a position. `moved` is the
    /// movement of the ball since it was last near, µm. Returns whether it has moved in a run-out.
    fn update(&mut self, captured: Micros, motors: PerMotor<i32>, moved: PerAxis<i32>) -> bool {
        let before = self.motors.unwrap_or(motors);
        // As the ball's filter does.
        let turned = per_motor(|i| motors[i].saturating_sub(before[i]) >> 2);
        self.motors = Some(per_motor(|i| before[i] + turned[i]));
        let mut runs_out = false;
        for way in self.ways.iter_mut().filter(|way| way.left > 0) {
            runs_out = runs_out || is_along(moved, way.ball) && is_along(turned, way.motors);
            way.left -= u8::from(captured > way.until);
        }
        runs_out
    }
}

/// Returns whether `movement` has a part along `way`, of the ball or of the motors.
fn is_along<const N: usize>(movement: [i32; N], way: [i32; N]) -> bool {
    // Bits: 30 + 31, 63 the sum of three.
    let along: i64 = (0..N).map(|i| signed_product(movement[i], way[i])).sum();
    along > 0
}

/// Guard against a motor that turns far while the ball stays where it is: a cable is slack, slips
/// or is torn, a motor has stalled, or the ball is caught.
///
/// The ends of a taut cable are apart by its length. By the triangle inequality a ball on taut
/// cables therefore moves at least as far as the length of any cable changes, whatever the rig's
/// geometry. The guard compares both from one place to the next: a place ends when the ball has
/// left it. It does not depend on the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct MotionWithoutBallGuard {
    place: Option<Place>,
}

/// Where the ball and the motors were at first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place {
    /// Position of the ball, µm.
    ball: PerAxis<i32>,
    /// Motor positions, Q4 steps.
    motors: PerMotor<i32>,
}

impl MotionWithoutBallGuard {
    /// Takes in the filtered position of the `ball` (µm) and the positions of the `motors` (Q4
    /// steps). Returns whether a motor has turned by the rule's turn while the ball has moved along
    /// no axis by more than the rule's movement.
    fn update(&mut self, ball: PerAxis<i32>, motors: PerMotor<i32>, rule: &Following) -> bool {
        let place = *self.place.get_or_insert(Place { ball, motors });
        if farthest(ball, place.ball) > rule.movement.0.unsigned_abs() {
            self.place = Some(Place { ball, motors });
            return false;
        }
        farthest(motors, place.motors) > rule.turn.0.unsigned_abs()
    }
}

/// Returns the largest difference of a component, of the ball or of the motors.
fn farthest<const N: usize>(a: [i32; N], b: [i32; N]) -> u32 {
    (0..N).fold(0, |most, i| a[i].abs_diff(b[i]).max(most))
}

/// Guard against a ball outside the radius of its target that gets no nearer: the target is out of
/// reach, or the law has come to a standstill.
///
/// As in the [divergence guard](DivergenceGuard), the nearest position so far is measured from the
/// present target: targets that come often do not disarm the guard, and a ball that follows a
/// moving target is nearer to it than where it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct ProgressGuard {
    /// Position at the last progress, and when that was; `None` within the radius.
    last: Option<(Nearest, Micros)>,
}

impl ProgressGuard {
    /// Takes in the present position; `radius` is that of a reached target, µm. Returns whether
    /// the error has not fallen by the rule's margin for the rule's time.
    fn update(&mut self, now: Micros, here: Nearest, radius: u32, rule: &Progress) -> bool {
        if here.error <= radius {
            self.last = None;
            return false;
        }
        let (nearest, since) = match self.last {
            Some((nearest, since)) => (nearest.seen_from(here.target), since),
            None => (here, now),
        };
        let margin = rule.margin.0.unsigned_abs();
        let is_nearer = here.error.saturating_add(margin) <= nearest.error;
        let (nearest, since) = if is_nearer { (here, now) } else { (nearest, since) };
        self.last = Some((nearest, since));
        now.since(since) >= u64::from(rule.time.0) * 1000
    }
}

/// A position of the ball and its distance from a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Nearest {
    /// Position of the ball, µm.
    position: PerAxis<i32>,
    /// The target that `error` belongs to.
    target: Point,
    /// Distance between the two, µm.
    error: u32,
}

impl Nearest {
    /// Returns the same position with its distance from `target`.
    fn seen_from(self, target: Point) -> Self {
        if self.target == target {
            return self;
        }
        Self { target, error: magnitude(error(self.position, target)), ..self }
    }
}

#[cfg(test)]
mod tests {
    use plumb_protocol::units::{Micrometres, Steps16};

    use super::*;

    const RULE: Following = Following { turn: Steps16(1600), movement: Micrometres(20_000) };

    /// Returns whether the guard stops a motor that turned by `turn` while the ball moved by
    /// `movement`, and one that turned by the rule's turn more from there.
    fn stops(turn: i32, movement: i32) -> [bool; 2] {
        let mut guard = MotionWithoutBallGuard::default();
        assert!(!guard.update([0; 3], [0; 3], &RULE));
        let ball = [0, -movement, 0];
        let first = guard.update(ball, [0, 0, -turn], &RULE);
        [first, guard.update(ball, [0, 0, -turn - RULE.turn.0], &RULE)]
    }

    #[test]
    fn a_motor_may_turn_by_the_rules_turn_and_no_further() {
        assert_eq!(stops(1600, 0), [false, true]);
        assert_eq!(stops(1601, 0), [true, true]);
    }

    #[test]
    fn the_ball_must_move_by_more_than_the_rules_movement_to_be_at_another_place() {
        assert_eq!(stops(1, 20_000), [false, true]);
        assert_eq!(stops(1601, 20_000), [true, true]);
        assert_eq!(stops(1601, 20_001), [false, false]);
    }
}
