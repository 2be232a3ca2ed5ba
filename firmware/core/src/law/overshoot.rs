//! Detection of overshoot: the ball has gone past its target.

use crate::wide::signed_product;

/// Distance from the target below which noise hides an overshoot, µm.
pub(super) const MIN_OVERSHOOT_UM: u32 = 7_000;

/// Detects that the ball changes over to the other side of its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct OvershootDetector {
    /// Error on the side where the ball was last, µm; zero at first.
    last: [i32; 3],
}

impl OvershootDetector {
    /// Takes the error `e` (µm, 24 bits) and its length, and returns whether the ball has gone
    /// past its target since it was last farther than [`MIN_OVERSHOOT_UM`] from it.
    pub(super) fn overshoots(&mut self, e: [i32; 3], distance: u32) -> bool {
        if distance <= MIN_OVERSHOOT_UM {
            return false;
        }
        // Bits: 24 + 24, 50 the sum.
        let along: i64 = (0..3).map(|i| signed_product(e[i], self.last[i])).sum();
        if along <= 0 {
            self.last = e;
        }
        along < 0
    }
}
