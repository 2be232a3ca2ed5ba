//! Ways that the ball still goes to targets that were replaced.

use plumb_protocol::units::Micros;

use crate::plan::RunOut;
use crate::wide::signed_product;

/// Old ways that are kept at most.
const WAYS: usize = 8;

/// Least time from one old way that is kept to the next, µs. A target that was in force for less
/// moves the ball by little.
const SPACING_US: u64 = 150_000;

/// Positions that are taken in after the end of an old way until the filtered position has left
/// it: the filter, which goes a quarter of the way with each, is then within a tenth of its lag.
const POSITIONS: u8 = 8;

/// Turn of a motor below which it stands, Q4 steps: a full step.
const STANDS: u32 = 16;

/// Way that the ball still goes after a change of its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct OldWay {
    /// When no setpoint for the old target turns the motors any more.
    until: Micros,
    /// From the ball to its old target, µm.
    ball: [i32; 3],
    /// From the filtered motor positions to those at which the motors come to rest without a new
    /// setpoint, Q4 steps.
    motors: [i32; 3],
    /// Positions captured after `until` that are still to come; 0 for a way that has ended.
    left: u8,
}

/// Old ways of a drive.
///
/// A change of the target changes the setpoint at once and the motors later: they ramp within
/// their acceleration, and follow the moving average of the step plan. The ball goes on, and its
/// filtered position follows some pictures later. The ball is on an old way while it moves towards
/// the old target, the motors turn as their old setpoints have them turn, and these setpoints
/// still have an effect. A ball that its motors drive away from every target is on none of them,
/// however often targets come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct OldWays {
    ways: [OldWay; WAYS],
    /// Index of the oldest one.
    oldest: usize,
    /// When the newest one was noted.
    since: Option<Micros>,
    /// Motor positions at the captures, filtered as the ball's are: Q4 steps; `None` before the
    /// first position.
    motors: Option<[i32; 3]>,
}

impl OldWays {
    /// Forgets all old ways. (In place: to copy a new value takes the stepping interrupt longer.)
    pub(super) fn clear(&mut self) {
        self.ways.iter_mut().for_each(|way| way.left = 0);
        (self.since, self.motors) = (None, None);
    }

    /// Notes at `now` that the target is replaced to which the ball had `way` to go (µm), while the
    /// motors come to rest by `run_out` without a new setpoint.
    pub(super) fn note(&mut self, now: Micros, way: [i32; 3], run_out: &RunOut) {
        let Some(motors) = self.motors else { return };
        let turn = [0, 1, 2].map(|i| run_out.motors[i].saturating_sub(motors[i]));
        let is_close = self.since.is_some_and(|since| now.since(since) < SPACING_US);
        if is_close || turn.iter().all(|turn| turn.unsigned_abs() < STANDS) {
            return;
        }
        self.since = Some(now);
        let until = Micros(now.0 + run_out.time_us);
        self.ways[self.oldest] = OldWay { until, ball: way, motors: turn, left: POSITIONS };
        self.oldest = (self.oldest + 1) % WAYS;
    }

    /// Takes in the motor positions (Q4 steps) at the capture of a position. `moved` is the
    /// movement of the ball since it was last near, µm. Returns whether it has moved on an old way.
    pub(super) fn update(&mut self, captured: Micros, motors: [i32; 3], moved: [i32; 3]) -> bool {
        let before = self.motors.unwrap_or(motors);
        // As the ball's filter does.
        let turned = [0, 1, 2].map(|i| motors[i].saturating_sub(before[i]) >> 2);
        self.motors = Some([0, 1, 2].map(|i| before[i] + turned[i]));
        let mut is_old = false;
        for way in self.ways.iter_mut().filter(|way| way.left > 0) {
            is_old = is_old || is_along(moved, way.ball) && is_along(turned, way.motors);
            way.left -= u8::from(captured > way.until);
        }
        is_old
    }
}

/// Returns whether `movement` has a part along `way`.
fn is_along(movement: [i32; 3], way: [i32; 3]) -> bool {
    // Bits: 30 + 31, 63 the sum.
    let along: i64 = (0..3).map(|i| signed_product(movement[i], way[i])).sum();
    along > 0
}
