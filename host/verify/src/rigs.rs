//! Kinds of rigs and places of the ball: boxes of geometries, and the straight way of one rig.
//!
//! A rig is D = y_A - y_B, W = x_A - x_C, t = (y_C - y_B)/D, and the ball is at barycentric λ in
//! the triangle, h below the motors. Scaling all lengths leaves J as it is.

use thiserror::Error;

use super::Interval;

/// Motors are told to so many metres where no tolerance is given.
const WRITTEN_M: f64 = 1e-6;

/// Rigs and places of the ball; metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigs {
    /// D.
    pub depth: Interval,
    /// W.
    pub width: Interval,
    /// t.
    pub apex: Interval,
    /// The least of the three λ, at most 1/3.
    pub least_lambda: f64,
    /// h.
    pub below: Interval,
}

impl Rigs {
    /// Rigs of which each coordinate of the motors A, B, C (metres, rig frame) is within
    /// `tolerance` of what is given, with the ball where λ >= `least_lambda`, `below` the motors.
    ///
    /// # Errors
    /// Where there may be no such rig; see [`Rigs::check`].
    pub fn around(
        motors: &[[f64; 3]; 3],
        tolerance: f64,
        least_lambda: f64,
        below: Interval,
    ) -> Result<Self, RigsError> {
        let [a, b, c] = motors;
        let apart = (a[0] - b[0]).abs().max((a[2] - b[2]).abs()).max((a[2] - c[2]).abs());
        let in_frame = apart <= 2.0 * tolerance + WRITTEN_M;
        if !in_frame {
            return Err(RigsError::Frame);
        }
        let near = |x: f64| Interval::point(x) + Interval::new(-tolerance, tolerance);
        let depth = near(a[1]) - near(b[1]);
        let width = near(a[0]).min(near(b[0])).to(near(a[0]).max(near(b[0]))) - near(c[0]);
        let apex = (near(c[1]) - near(b[1])) / depth;
        Self { depth, width, apex, least_lambda, below }.check()
    }

    /// The same, if every rig of it is one.
    ///
    /// # Errors
    /// Names what is out of its range.
    pub fn check(self) -> Result<Self, RigsError> {
        let Self { depth, width, apex, least_lambda, below } = self;
        let checks = [
            (depth.lo > 0.0, RigsError::Depth(depth.lo)),
            (width.lo > 0.0, RigsError::Width(width.lo)),
            (below.lo > 0.0 && below.hi >= below.lo, RigsError::Below(below.lo, below.hi)),
            (apex.lo >= 0.0 && apex.hi <= 1.0, RigsError::Apex(apex.lo, apex.hi)),
            ((0.0..=0.33).contains(&least_lambda), RigsError::Lambda(least_lambda)),
        ];
        checks.into_iter().find(|(holds, _)| !holds).map_or(Ok(self), |(_, error)| Err(error))
    }

    /// docs/understand/proofs.md: all D, W in 0.5-1.5 m, t in 0-1, the closed triangle, h in
    /// `least_below`-1 m.
    #[must_use]
    pub fn wide(least_below: f64) -> Self {
        Self {
            depth: Interval::new(0.5, 1.5),
            width: Interval::new(0.5, 1.5),
            apex: Interval::new(0.0, 1.0),
            least_lambda: 0.0,
            below: Interval::new(least_below, 1.0),
        }
    }
}

/// Why there is no such kind of rigs.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum RigsError {
    /// The rig frame is another one.
    #[error("the motors must be at one height, A and B at one x (docs/understand/plant.md)")]
    Frame,
    /// D may be 0.
    #[error("D = yA - yB must be above 0; it may be {0:.3} m")]
    Depth(f64),
    /// W may be 0.
    #[error("W = xA - xC must be above 0; it may be {0:.3} m")]
    Width(f64),
    /// t may be outside.
    #[error("t = (yC - yB)/D must be from 0 to 1; it is from {0:.3} to {1:.3}")]
    Apex(f64, f64),
    /// h may be 0.
    #[error(
        "h must be above 0, its upper end not below its lower one; it is from {0:.3} to {1:.3} m"
    )]
    Below(f64, f64),
    /// Out of its range.
    #[error("the least λ must be from 0 to 0.33, not {0}")]
    Lambda(f64),
    /// No way for this.
    #[error("the way from {0:?} to {1:?} does not stay inside the triangle of motors, below them")]
    Outside([f64; 3], [f64; 3]),
}

/// A box of them with D = 1: w = W/D, t, λ_A, λ_C, h/D.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cell(pub(super) [Interval; 5]);

/// λ and cable lengths over a cell, D = 1.
pub(super) struct Shape {
    pub(super) w: Interval,
    pub(super) t: Interval,
    pub(super) lambda: [Interval; 3],
    pub(super) lengths: [Interval; 3],
    pub(super) h: Interval,
}

impl Cell {
    pub(super) fn whole(rigs: &Rigs) -> Self {
        let lambda = Interval::new(rigs.least_lambda, (1.0 - 2.0 * rigs.least_lambda).next_up());
        Self([rigs.width / rigs.depth, rigs.apex, lambda, lambda, rigs.below / rigs.depth])
    }

    /// Whether a rig of `rigs` may be in it.
    pub(super) fn contains_some(&self, rigs: &Rigs) -> bool {
        let [w, _, a, c, h] = self.0;
        let one = Interval::point(1.0);
        // D is in its range, and so are W = w D and h D.
        let (by_width, by_below) = (rigs.width / w, rigs.below / h);
        let least = rigs.depth.lo.max(by_width.lo).max(by_below.lo);
        let most = rigs.depth.hi.min(by_width.hi).min(by_below.hi);
        least <= most && (one - a - c).hi >= rigs.least_lambda
    }

    pub(super) fn halves(&self, sizes: [f64; 5]) -> [Self; 2] {
        let size = |k: usize| self.0[k].width() / sizes[k];
        let widest = (0..5).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(0);
        self.0[widest].halves().map(|half| {
            let mut cell = *self;
            cell.0[widest] = half;
            cell
        })
    }

    pub(super) fn shape(&self, least_lambda: f64) -> Shape {
        let [w, t, a, c, h] = self.0;
        let one = Interval::point(1.0);
        let b = one - a - c;
        let b = Interval::new(b.lo.max(least_lambda), b.hi.max(least_lambda));
        // From A: (w λ_C, λ_B + λ_C (1 - t)); from B: (w λ_C, λ_A + λ_C t); from C: (w (1 - λ_C),
        // (1 - t) λ_A - t λ_B).
        let far = (w * c).square() + h.square();
        let lengths = [
            (far + (b + c * (one - t)).square()).sqrt(),
            (far + (a + c * t).square()).sqrt(),
            ((w * (one - c)).square() + ((one - t) * a - t * b).square() + h.square()).sqrt(),
        ];
        Shape { w, t, lambda: [a, b, c], lengths, h }
    }
}

/// The straight way of the ball between two points, in one rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    w: Interval,
    t: Interval,
    /// λ_A, λ_C and h/D at both ends.
    ends: [[Interval; 3]; 2],
}

impl Way {
    /// From `start` to `target` between the motors A, B, C; metres, rig frame.
    ///
    /// # Errors
    /// Where the motors are no rig, or an end is not inside their triangle and below them.
    pub fn new(
        motors: &[[f64; 3]; 3],
        start: [f64; 3],
        target: [f64; 3],
    ) -> Result<Self, RigsError> {
        let height = motors[0][2];
        let rigs =
            Rigs::around(motors, 0.0, 0.0, Interval::point(height - start[2].min(target[2])))?;
        let [a, b, _] = motors.map(|motor| motor.map(Interval::point));
        let place = |p: [f64; 3]| {
            let [x, y, z] = p.map(Interval::point);
            let by_c = (a[0] - x) / rigs.width;
            let by_a = (y - b[1]) / rigs.depth - by_c * rigs.apex;
            [by_a, by_c, (a[2] - z) / rigs.depth]
        };
        let ends = [place(start), place(target)];
        let inside = |[by_a, by_c, h]: [Interval; 3]| {
            by_a.lo > 0.0 && by_c.lo > 0.0 && (by_a + by_c).hi < 1.0 && h.lo > 0.0
        };
        if !ends.into_iter().all(inside) {
            return Err(RigsError::Outside(start, target));
        }
        Ok(Self { w: rigs.width / rigs.depth, t: rigs.apex, ends })
    }

    /// Where the ball is from `part.lo` to `part.hi` of the way.
    pub(super) fn cell(&self, part: Interval) -> Cell {
        let [from, to] = self.ends;
        let along = |n: usize| from[n] + part * (to[n] - from[n]);
        Cell([self.w, self.t, along(0), along(1), along(2)])
    }
}
