//! How often the ball went past its target, and what the law makes of that.

use crate::law::sides::Sides;
use crate::law::sign;

/// Going past the target is nothing to worry about so many times. Each further time so much is left
/// of the rates, Q8, and at least so much.
const FREE: u8 = 1;
const CUT: u32 = 192;
const CALMEST: u32 = 26;

/// How often the ball went past its target, for which the law grows calmer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Swings {
    target: [i32; 3],
    sides: Sides,
    passed: u8,
    /// What is left of the rates, Q8.
    calm: u32,
}

impl Swings {
    /// On the way to this target.
    pub(super) fn to(target: [i32; 3]) -> Self {
        Self { target, sides: Sides::default(), passed: 0, calm: 256 }
    }

    /// What is left of the rates, Q8, with the error `e` ahead, µm.
    pub(super) fn calm(&mut self, target: [i32; 3], e: [i32; 3]) -> u32 {
        if self.target != target {
            *self = Self::to(target);
        }
        if self.sides.passed(e, sign::distance(e)) {
            self.passed = self.passed.saturating_add(1);
            if self.passed > FREE {
                self.calm = ((self.calm * CUT) >> 8).max(CALMEST);
            }
        }
        self.calm
    }
}
