//! The rule of the divergence guard without run-outs, for comparison.

use plumb_core::servo::{BallTracker, error, magnitude};
use plumb_protocol::config::{Config, Growth};
use plumb_protocol::units::{Micros, Point};

/// State of the rule: the error from the present target stays above that of the nearest position
/// so far, whichever way setpoints for earlier targets have the ball go.
pub(super) struct PlainRule {
    config: Config,
    tracker: BallTracker,
    /// Position nearest to the present target, µm.
    nearest: Option<[i32; 3]>,
    /// When the error began to stay above the margin.
    since: Option<Micros>,
}

impl PlainRule {
    /// Returns the rule with the limits of `config`.
    pub(super) fn new(config: Config) -> Self {
        Self { config, tracker: BallTracker::default(), nearest: None, since: None }
    }

    /// Takes in a position of a drive to `target`. Returns whether a board with this rule stops.
    pub(super) fn update(&mut self, now: Micros, ball: Point, target: Point) -> bool {
        if !self.config.workspace.contains(ball) {
            return false;
        }
        self.tracker.update(now, ball.micrometres());
        let Some(here) = self.tracker.filtered() else { return false };
        let distance = |place| magnitude(error(place, target));
        let before = self.nearest.unwrap_or(here);
        let nearest = if distance(here) <= distance(before) { here } else { before };
        self.nearest = Some(nearest);
        let Growth { margin, time } = self.config.growth;
        if distance(here) <= distance(nearest) + margin.0.unsigned_abs() {
            self.since = None;
            return false;
        }
        let since = *self.since.get_or_insert(now);
        now.since(since) >= u64::from(time.0) * 1000
    }
}
