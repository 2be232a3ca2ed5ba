//! Normalised geometry of a rig and a ball position: boxes with D = 1, and the cable lengths in
//! them.

use super::{Interval, RigFamily};

/// A box of normalised rigs and ball positions: w = W/D, t, λ_A, λ_C, h/D.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cell(pub(super) [Interval; 5]);

/// Barycentric coordinates and cable lengths over a cell; lengths are in units of D.
pub(super) struct Geometry {
    /// W/D.
    pub(super) w: Interval,
    /// t.
    pub(super) t: Interval,
    /// λ of A, B, C.
    pub(super) lambda: [Interval; 3],
    /// Cable lengths of A, B, C.
    pub(super) lengths: [Interval; 3],
    /// h/D.
    pub(super) h: Interval,
}

impl Cell {
    /// Returns the smallest cell that contains the family.
    pub(super) fn whole(rigs: &RigFamily) -> Self {
        let lambda = Interval::new(rigs.min_lambda, (1.0 - 2.0 * rigs.min_lambda).next_up());
        Self([rigs.width / rigs.depth, rigs.apex, lambda, lambda, rigs.below / rigs.depth])
    }

    /// Returns false if the cell certainly contains no rig of the family.
    pub(super) fn may_intersect(&self, rigs: &RigFamily) -> bool {
        let [w, _, a, c, h] = self.0;
        let one = Interval::point(1.0);
        // The range of D follows from its own bounds and from those of W = w D and of h.
        let (by_width, by_below) = (rigs.width / w, rigs.below / h);
        let lower = rigs.depth.lo.max(by_width.lo).max(by_below.lo);
        let upper = rigs.depth.hi.min(by_width.hi).min(by_below.hi);
        lower <= upper && (one - a - c).hi >= rigs.min_lambda
    }

    /// Splits the cell across its side that is widest relative to `scales`.
    pub(super) fn halves(&self, scales: [f64; 5]) -> [Self; 2] {
        let size = |k: usize| self.0[k].width() / scales[k];
        let widest = (0..5).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(0);
        self.0[widest].halves().map(|half| {
            let mut cell = *self;
            cell.0[widest] = half;
            cell
        })
    }

    /// Encloses the geometry of every rig in the cell with λ_B >= `min_lambda`.
    ///
    /// The horizontal offsets of the ball are (w λ_C, λ_B + λ_C (1 - t)) from A,
    /// (w λ_C, λ_A + λ_C t) from B and (w (1 - λ_C), (1 - t) λ_A - t λ_B) from C.
    pub(super) fn geometry(&self, min_lambda: f64) -> Geometry {
        let [w, t, a, c, h] = self.0;
        let one = Interval::point(1.0);
        let b = one - a - c;
        let b = Interval::new(b.lo.max(min_lambda), b.hi.max(min_lambda));
        let far = (w * c).square() + h.square();
        let lengths = [
            (far + (b + c * (one - t)).square()).sqrt(),
            (far + (a + c * t).square()).sqrt(),
            ((w * (one - c)).square() + ((one - t) * a - t * b).square() + h.square()).sqrt(),
        ];
        Geometry { w, t, lambda: [a, b, c], lengths, h }
    }
}
