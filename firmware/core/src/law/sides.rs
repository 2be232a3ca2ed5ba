//! On which side of its target the ball was: how a law notices that it went past.

use crate::wide::signed_product;

/// Going past the target by less is noise, µm.
pub(super) const PAST: u32 = 7_000;

/// The error on the side of the target that the ball was on last, µm; zero at first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Sides {
    last: [i32; 3],
}

impl Sides {
    /// Whether the ball, with the error `e` (µm, 24 bits) of this length, has gone past its target
    /// since it was last so far from it.
    pub(super) fn passed(&mut self, e: [i32; 3], distance: u32) -> bool {
        if distance <= PAST {
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
