//! What keeps a loop from swinging for ever, and a bank from being stuck for ever.

use super::geometry::{Vector, dot, length, scaled};

/// A swing past the target counts from this far, mm: above what the noise of 2, 1, 1 mm leaves in
/// the estimate (below 1), and well below a threshold of 10 mm.
const SWING: f32 = 4.0;
/// So many swings are let be, and each that follows leaves so much of the pace.
const FREE: u8 = 1;
const CALMER: f32 = 0.4;
/// The pace is never less. At 12/s times this a loop of no other delay is stable about a mode of
/// 0.6 Hz and ζ = 0.02: below 2 ζ ω.
const SLOWEST: f32 = 0.012;
/// A bank that in the mean of so many pictures has not brought the ball nearer by this much (mm)
/// than in those before, and not to within 6 mm, has got stuck. In the mean: a ball that swings
/// about its target is not lost.
const PATIENCE: u8 = 45;
const NEARER: f32 = 3.0;
const THERE: f32 = 6.0;
/// After as many pictures without a swing, and not there yet, the pace grows by this: what swung
/// has come to rest.
const QUICKER: f32 = 2.0;

/// Watches the error on its way to one target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Watch {
    target: Vector,
    /// The farthest that the ball was off on the side where it is, mm.
    side: Vector,
    swings: u8,
    /// Those that were counted when the pictures' sum began.
    counted: u8,
    pace: f32,
    /// Pictures that are summed up, their errors, and how long the mean of those before was, mm.
    pictures: u8,
    sum: Vector,
    before: f32,
}

impl Watch {
    /// On the way to a new target, mm.
    pub(super) fn new(target: Vector) -> Self {
        Self {
            target,
            side: [0.0; 3],
            swings: 0,
            counted: 0,
            pace: 1.0,
            pictures: 0,
            sum: [0.0; 3],
            before: f32::MAX,
        }
    }

    /// What of its pace the law is to keep, [`SLOWEST`] to 1. With each time the ball goes by its
    /// target to the other side there is less: a loop that swings is too quick for what it does not
    /// know of the rig, and on a slower one springs come to rest. There is more again where a ball
    /// at rest is still on its way.
    pub(super) fn pace(&self) -> f32 {
        self.pace
    }

    /// Takes in the error (mm) on the way to `target`; whether the bank has got stuck.
    pub(super) fn look(&mut self, target: Vector, e: Vector) -> bool {
        if target != self.target {
            *self = Self::new(target);
        }
        self.count_swings(e);
        self.pictures += 1;
        self.sum = [0, 1, 2].map(|i| self.sum[i] + e[i]);
        if self.pictures < PATIENCE {
            return false;
        }
        let mean = length(scaled(self.sum, 1.0 / f32::from(PATIENCE)));
        let stuck = mean > THERE && mean > self.before - NEARER;
        if mean > THERE && self.swings == self.counted {
            self.pace = (QUICKER * self.pace).min(1.0);
        }
        self.counted = self.swings;
        (self.pictures, self.sum, self.before) = (0, [0.0; 3], mean);
        stuck
    }

    fn count_swings(&mut self, e: Vector) {
        if dot(e, self.side) < 0.0 {
            if length(e) < SWING {
                return;
            }
            self.side = e;
            self.swings = self.swings.saturating_add(1);
            if self.swings > FREE {
                self.pace = (CALMER * self.pace).max(SLOWEST);
            }
        } else if dot(e, e) > dot(self.side, self.side) {
            self.side = e;
        }
    }
}
