//! Minimum over all directions of the error e, by branch and bound over patches of directions.

use super::Interval;
use super::branch_and_bound::{Minimum, minimise};

/// A rectangle on a face of the cube |e|∞ = 1.
///
/// Three faces cover all directions, because v(-e) = -v(e).
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    face: usize,
    sides: [Interval; 2],
}

impl Patch {
    /// Returns the three faces.
    fn faces() -> Vec<Self> {
        let side = Interval::new(-1.0, 1.0);
        (0..3).map(|face| Self { face, sides: [side; 2] }).collect()
    }

    /// Splits the patch across its wider side.
    fn halves(&self) -> Vec<Self> {
        let wider = usize::from(self.sides[1].width() > self.sides[0].width());
        let with = |half| {
            let mut patch = *self;
            patch.sides[wider] = half;
            patch
        };
        self.sides[wider].halves().map(with).to_vec()
    }

    /// Returns the vector with `one` in the face's coordinate and `sides` in the other two.
    fn at<T: Copy>(&self, one: T, sides: [T; 2]) -> [T; 3] {
        let mut e = [one; 3];
        e[(self.face + 1) % 3] = sides[0];
        e[(self.face + 2) % 3] = sides[1];
        e
    }

    /// Returns the box that contains every e of the patch.
    pub(super) fn e(&self) -> [Interval; 3] {
        self.at(Interval::point(1.0), self.sides)
    }

    /// Returns the e at the midpoint.
    pub(super) fn centre(&self) -> [f64; 3] {
        self.at(1.0, self.sides.map(Interval::midpoint))
    }
}

/// Minimises a function over all directions of e; see [`minimise`].
pub(super) fn minimise_over_directions(
    enclosure: impl FnMut(&Patch) -> Interval,
    converged: impl Fn(Interval) -> bool,
    max_patches: usize,
) -> Option<Minimum<Patch>> {
    minimise(Patch::faces(), enclosure, Patch::halves, converged, max_patches)
}
