//! The guard against an error that grows.

use plumb_protocol::config::Growth;
use plumb_protocol::units::{Micros, Point};

use super::{error, magnitude};

/// Guard against an error that stays above its smallest value so far: the ball is driven away from
/// its target.
///
/// The guard keeps the nearest position so far and measures its error from the present target.
/// Therefore a change of the target neither disarms the guard nor trips it, however often targets
/// come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DivergenceGuard {
    nearest: Option<Nearest>,
    /// When the error began to stay above the margin.
    since: Option<Micros>,
}

/// The position nearest to the target so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Nearest {
    /// Position of the ball, µm.
    position: [i32; 3],
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

impl DivergenceGuard {
    /// Takes in the filtered `position` and its distance from `target`, both µm. Returns whether
    /// the error has been above its smallest value and the rule's margin for the rule's time.
    pub fn update(
        &mut self,
        now: Micros,
        position: [i32; 3],
        error: u32,
        target: Point,
        rule: &Growth,
    ) -> bool {
        let here = Nearest { position, target, error };
        let before = self.nearest.map_or(here, |nearest| nearest.seen_from(target));
        let nearest = if error <= before.error { here } else { before };
        self.nearest = Some(nearest);
        if error <= nearest.error.saturating_add(rule.margin.0.unsigned_abs()) {
            self.since = None;
            return false;
        }
        let since = *self.since.get_or_insert(now);
        now.since(since) >= u64::from(rule.time.0) * 1000
    }
}
