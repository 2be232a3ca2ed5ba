//! Families of rigs: boxes of motor positions and of ball positions, and the normalised geometry of
//! a box, with D = 1.

use plumb_protocol::{PerAxis, PerMotor};
use serde::Serialize;
use thiserror::Error;

use crate::Interval;

/// Precision of motor positions if the tolerance is 0, m.
const MOTOR_PRECISION_M: f64 = 1e-6;

/// A box of rigs and of ball positions in them.
///
/// J depends on ratios of lengths only, so that a rig at another scale has the same J.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RigFamily {
    /// D = y_A - y_B, m, above 0.
    pub depth: Interval,
    /// W = x_A - x_C, m, above 0.
    pub width: Interval,
    /// t = (y_C - y_B)/D, from 0 to 1.
    pub apex: Interval,
    /// Lower bound of the ball's three barycentric coordinates λ, from 0 to 0.33.
    pub min_lambda: f64,
    /// h, the ball's depth below the motors, m, above 0.
    pub below: Interval,
}

impl RigFamily {
    /// Returns the rigs with every motor coordinate within `tolerance` (m) of `motors`.
    ///
    /// `motors` are A, B, C in the rig frame, m. The ball is where λ >= `min_lambda`, at a depth
    /// `below` (m) the motors.
    ///
    /// # Errors
    /// [`RigFamilyError`] if the motors are not in the rig frame, or as [`RigFamily::check`].
    pub fn around(
        motors: &PerMotor<PerAxis<f64>>,
        tolerance: f64,
        min_lambda: f64,
        below: Interval,
    ) -> Result<Self, RigFamilyError> {
        let [a, b, c] = motors;
        let apart = (a[0] - b[0]).abs().max((a[2] - b[2]).abs()).max((a[2] - c[2]).abs());
        let in_frame = apart <= 2.0 * tolerance + MOTOR_PRECISION_M;
        if !in_frame {
            return Err(RigFamilyError::Frame);
        }
        let near = |x: f64| Interval::point(x) + Interval::new(-tolerance, tolerance);
        let depth = near(a[1]) - near(b[1]);
        let width = near(a[0]).min(near(b[0])).to(near(a[0]).max(near(b[0]))) - near(c[0]);
        let apex = (near(c[1]) - near(b[1])) / depth;
        Self { depth, width, apex, min_lambda, below }.check()
    }

    /// Checks that every member of the family is a rig.
    ///
    /// # Errors
    /// [`RigFamilyError`] with the first quantity that leaves its range.
    pub fn check(self) -> Result<Self, RigFamilyError> {
        let Self { depth, width, apex, min_lambda, below } = self;
        let checks = [
            (depth.lo > 0.0, RigFamilyError::Depth(depth.lo)),
            (width.lo > 0.0, RigFamilyError::Width(width.lo)),
            (below.lo > 0.0 && below.hi >= below.lo, RigFamilyError::Below(below.lo, below.hi)),
            (apex.lo >= 0.0 && apex.hi <= 1.0, RigFamilyError::Apex(apex.lo, apex.hi)),
            ((0.0..=0.33).contains(&min_lambda), RigFamilyError::Lambda(min_lambda)),
        ];
        checks.into_iter().find(|(holds, _)| !holds).map_or(Ok(self), |(_, error)| Err(error))
    }

    /// Returns the wide family of docs/understand/proofs.md: D and W from 0.5 m to 1.5 m, t from 0
    /// to 1, the closed triangle, h from `min_below` to 1 m.
    #[must_use]
    pub fn wide(min_below: f64) -> Self {
        Self {
            depth: Interval::new(0.5, 1.5),
            width: Interval::new(0.5, 1.5),
            apex: Interval::new(0.0, 1.0),
            min_lambda: 0.0,
            below: Interval::new(min_below, 1.0),
        }
    }
}

/// Reason why a family of rigs or a path is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum RigFamilyError {
    /// The motors are not in the rig frame.
    #[error("the motors must be at one height, A and B at one x (docs/understand/plant.md)")]
    Frame,
    /// D may be 0 or less.
    #[error("D = yA - yB must be above 0; it may be {0:.3} m")]
    Depth(f64),
    /// W may be 0 or less.
    #[error("W = xA - xC must be above 0; it may be {0:.3} m")]
    Width(f64),
    /// t may be outside 0 to 1.
    #[error("t = (yC - yB)/D must be from 0 to 1; it is from {0:.3} to {1:.3}")]
    Apex(f64, f64),
    /// h may be 0 or less, or its bounds are in the wrong order.
    #[error("h must be above 0, with the lower bound first; it is from {0:.3} to {1:.3} m")]
    Below(f64, f64),
    /// The lower bound of λ is out of range.
    #[error("the minimum of λ must be from 0 to 0.33, not {0}")]
    Lambda(f64),
    /// A path leaves the workspace.
    #[error("the path from {0:?} to {1:?} leaves the triangle of motors or the space below it")]
    Outside(PerAxis<f64>, PerAxis<f64>),
}

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
    pub(super) lambda: PerMotor<Interval>,
    /// Cable lengths of A, B, C.
    pub(super) lengths: PerMotor<Interval>,
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
