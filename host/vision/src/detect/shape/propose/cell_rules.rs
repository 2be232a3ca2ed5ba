//! Where a ball's surface can be in a map of cells, and where a surface continues.

use std::ops::Range;

use super::super::view::FrameView;
use super::cell_map::CellMap;

/// Largest reach of a cell: with it a set of reaches is a number of 64 bits. A ball that has not
/// ended there fills more than 500 rows.
const MAX_REACH: f32 = 63.0;

/// When the surface of a cell continues in another cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Continuation {
    /// Least likeness of the other cell, in that of the cell itself.
    pub(super) same_object: f32,
    /// Least likeness of the other cell, 0 to 1.
    pub(super) least: f32,
    /// Largest depth of the other cell behind the cell, metres. A surface that continues towards
    /// the camera has not ended.
    pub(super) behind: f32,
}

impl Continuation {
    /// Makes the rule for the ball of `view`.
    pub(super) fn new(view: &FrameView) -> Self {
        let parameters = &view.parameters.clusters;
        let least = parameters.min_likeness / 2.0;
        Self { same_object: parameters.same_object, least, behind: view.ball_radius as f32 }
    }

    /// Checks whether the surface of a cell of this likeness and depth continues in another. Free
    /// of branches, so that the compiler computes many cells at once.
    #[inline(always)]
    pub(super) fn holds(
        &self,
        (likeness, depth): (f32, f32),
        (other, other_depth): (f32, f32),
    ) -> bool {
        let is_alike = other >= (self.same_object * likeness).max(self.least);
        is_alike & (other_depth < depth + self.behind)
    }
}

/// Where a ball's surface can be, and its reach: how far from there the ball has ended.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ReachRule {
    /// Least likeness of a cell, 0 to 1.
    min_likeness: f32,
    /// Depths of a surface, metres.
    depths: Range<f32>,
    /// Radius of the ball, metres: its surface is so much nearer than its centre.
    ball: f32,
    /// The part of the reach that goes with the ball's radius in the image, times the depth of the
    /// ball's centre, cells times metres.
    numerator: f32,
    /// The rest of the reach, cells.
    rest: f32,
}

impl ReachRule {
    /// Makes the rule for the ball and the camera of `view`.
    pub(super) fn new(view: &FrameView) -> Self {
        let (parameters, ball) = (&view.parameters.clusters, view.ball_radius);
        let surface = |radius| (view.intrinsics().depth_of(ball, radius) - ball) as f32;
        let (radii, beyond) = (view.possible_radii(), parameters.beyond);
        Self {
            min_likeness: parameters.min_likeness,
            depths: surface(radii.end)..surface(radii.start),
            ball: ball as f32,
            numerator: (beyond.relative * view.radius_at(1.0) / CellMap::FACTOR) as f32,
            rest: (beyond.pixels / CellMap::FACTOR) as f32,
        }
    }

    /// Returns the reach of a cell, whole cells up to [`MAX_REACH`]; 0 where no ball can be. Free
    /// of branches.
    #[inline(always)]
    pub(super) fn reach(&self, likeness: f32, depth: f32) -> f32 {
        let is_possible = (depth >= self.depths.start) & (depth < self.depths.end);
        let cells = (self.numerator / (depth + self.ball) + self.rest + 0.5).floor();
        let cells = if cells < MAX_REACH { cells } else { MAX_REACH };
        if is_possible & (likeness >= self.min_likeness) { cells } else { 0.0 }
    }
}
