//! The guard against an error that grows.

use plumb_protocol::config::Growth;
use plumb_protocol::units::{Micros, Point};

use super::guards::DriveState;
use super::nearest::Nearest;
use super::old_ways::OldWays;
use crate::plan::RunOut;

/// Guard against an error that stays above its smallest value so far: the ball is driven away from
/// its target.
///
/// The guard keeps the nearest position so far and measures its error from the present target.
/// Therefore a change of the target neither disarms the guard nor trips it, however often targets
/// come. On an [old way](OldWays) the error grows without a fault: there the present position
/// counts as the nearest one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct DivergenceGuard {
    /// The nearest position, seen from the target of the last position.
    nearest: Option<Nearest>,
    /// When the error began to stay above the margin.
    since: Option<Micros>,
    old_ways: OldWays,
}

impl DivergenceGuard {
    /// Begins anew, for the next drive.
    pub(super) fn reset(&mut self) {
        (self.nearest, self.since) = (None, None);
        self.old_ways.clear();
    }

    /// Returns the target of the last position; `None` before the first one.
    pub(super) fn last_target(&self) -> Option<Point> {
        self.nearest.map(|nearest| nearest.target)
    }

    /// Notes that the target is replaced; see [`OldWays::note`].
    pub(super) fn note_change(&mut self, now: Micros, way: [i32; 3], run_out: &RunOut) {
        self.old_ways.note(now, way, run_out);
    }

    /// Takes in the present position. Returns whether the error has been above its smallest value
    /// and the rule's margin for the rule's time.
    pub(super) fn update(&mut self, now: Micros, state: &DriveState, rule: &Growth) -> bool {
        let here = Nearest { position: state.ball, target: state.target, error: state.error };
        let before = self.nearest.map_or(here, |nearest| nearest.seen_from(here.target));
        let moved = [0, 1, 2].map(|i| here.position[i] - before.position[i]);
        let is_old = self.old_ways.update(state.captured, state.motors.at_capture, moved);
        let nearest = if here.error <= before.error || is_old { here } else { before };
        self.nearest = Some(nearest);
        if here.error <= nearest.error.saturating_add(rule.margin.0.unsigned_abs()) {
            self.since = None;
            return false;
        }
        let since = *self.since.get_or_insert(now);
        now.since(since) >= u64::from(rule.time.0) * 1000
    }
}
