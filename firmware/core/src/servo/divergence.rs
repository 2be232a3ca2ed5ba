//! The guard against an error that grows.

use plumb_protocol::config::Growth;
use plumb_protocol::units::Micros;

use super::nearest::Nearest;

/// Guard against an error that stays above its smallest value so far: the ball is driven away from
/// its target.
///
/// The guard keeps the nearest position so far and measures its error from the present target.
/// Therefore a change of the target neither disarms the guard nor trips it, however often targets
/// come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct DivergenceGuard {
    nearest: Option<Nearest>,
    /// When the error began to stay above the margin.
    since: Option<Micros>,
}

impl DivergenceGuard {
    /// Takes in the present position. Returns whether the error has been above its smallest value
    /// and the rule's margin for the rule's time.
    pub(super) fn update(&mut self, now: Micros, here: Nearest, rule: &Growth) -> bool {
        let before = self.nearest.map_or(here, |nearest| nearest.seen_from(here.target));
        let nearest = if here.error <= before.error { here } else { before };
        self.nearest = Some(nearest);
        if here.error <= nearest.error.saturating_add(rule.margin.0.unsigned_abs()) {
            self.since = None;
            return false;
        }
        let since = *self.since.get_or_insert(now);
        now.since(since) >= u64::from(rule.time.0) * 1000
    }
}
