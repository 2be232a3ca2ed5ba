//! The position nearest to the target so far, for guards that outlive a change of the target.

use plumb_protocol::units::Point;

use super::{error, magnitude};

/// A position of the ball and its distance from a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Nearest {
    /// Position of the ball, µm.
    pub(super) position: [i32; 3],
    /// The target that `error` belongs to.
    pub(super) target: Point,
    /// Distance between the two, µm.
    pub(super) error: u32,
}

impl Nearest {
    /// Returns the same position with its distance from `target`.
    pub(super) fn seen_from(self, target: Point) -> Self {
        if self.target == target {
            return self;
        }
        Self { target, error: magnitude(error(self.position, target)), ..self }
    }
}
