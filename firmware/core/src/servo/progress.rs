//! The guard against a ball that gets no nearer to its target.

use plumb_protocol::config::Progress;
use plumb_protocol::units::Micros;

use super::nearest::Nearest;

/// Guard against a ball outside the radius of its target that gets no nearer: the target is out of
/// reach, or the law has come to a standstill.
///
/// As in the [divergence guard](super::divergence::DivergenceGuard), the nearest position so far is
/// measured from the present target: targets that come often do not disarm the guard, and a ball
/// that follows a moving target is nearer to it than where it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct ProgressGuard {
    /// Position at the last progress, and when that was; `None` within the radius.
    last: Option<(Nearest, Micros)>,
}

impl ProgressGuard {
    /// Takes in the present position; `radius` is that of a reached target, µm. Returns whether
    /// the error has not fallen by the rule's margin for the rule's time.
    pub(super) fn update(
        &mut self,
        now: Micros,
        here: Nearest,
        radius: u32,
        rule: &Progress,
    ) -> bool {
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
