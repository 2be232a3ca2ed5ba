//! All directions of the error e, in patches that can be split.

use super::Interval;
use super::search::{Least, least};

/// A rectangle on a face of the cube |e|∞ = 1. Since v(-e) = -v(e), three faces are all directions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    face: usize,
    sides: [Interval; 2],
}

impl Patch {
    fn faces() -> Vec<Self> {
        let side = Interval::new(-1.0, 1.0);
        (0..3).map(|face| Self { face, sides: [side; 2] }).collect()
    }

    fn halves(&self) -> Vec<Self> {
        let wider = usize::from(self.sides[1].width() > self.sides[0].width());
        let with = |half| {
            let mut patch = *self;
            patch.sides[wider] = half;
            patch
        };
        self.sides[wider].halves().map(with).to_vec()
    }

    fn at<T: Copy>(&self, one: T, sides: [T; 2]) -> [T; 3] {
        let mut e = [one; 3];
        e[(self.face + 1) % 3] = sides[0];
        e[(self.face + 2) % 3] = sides[1];
        e
    }

    /// All e of it, as a box.
    pub(super) fn e(&self) -> [Interval; 3] {
        self.at(Interval::point(1.0), self.sides)
    }

    /// The e in its middle.
    pub(super) fn centre(&self) -> [f64; 3] {
        self.at(1.0, self.sides.map(Interval::middle))
    }
}

/// The least value over all directions of e of what `value` encloses for a patch of them; see
/// [`least`].
pub(super) fn over_directions(
    value: impl FnMut(&Patch) -> Interval,
    known: impl Fn(Interval) -> bool,
    most_patches: usize,
) -> Option<Least<Patch>> {
    least(Patch::faces(), value, Patch::halves, known, most_patches)
}

/// |x|.
pub(super) fn norm(x: [Interval; 3]) -> Interval {
    (x[0].square() + x[1].square() + x[2].square()).sqrt()
}

/// x · y.
pub(super) fn dot(x: [Interval; 3], y: [Interval; 3]) -> Interval {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

/// The determinant of a matrix by rows.
pub(super) fn determinant(m: &[[Interval; 3]; 3]) -> Interval {
    let minor = |r: usize, s: usize| m[1][r] * m[2][s] - m[1][s] * m[2][r];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}
