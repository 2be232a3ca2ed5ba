//! `plumb bounds`: what can be said of a law for every rig of a kind, by arithmetic that is rounded outwards.
//!
//! A rig is D = y_A - y_B, W = x_A - x_C, t = (y_C - y_B)/D, and the ball is at barycentric λ in the triangle, h below the
//! motors. Scaling all lengths leaves J as it is.

mod descent;
mod family;
mod interval;

pub use descent::{Descent, sign_descent};
pub use family::{jacobian_bounds, nonsingular};
pub use interval::Interval;

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
    /// The paper's rig with the ball where λ >= `least_lambda`, from 0.1 m below the motors to the rig's floor.
    #[must_use]
    pub fn paper(least_lambda: f64) -> Self {
        Self {
            depth: Interval::point(0.61),
            width: Interval::point(0.85),
            apex: Interval::point(0.24) / Interval::point(0.61),
            least_lambda,
            below: Interval::new(0.1, 0.665),
        }
    }

    /// docs/control.md: all D, W in 0.5-1.5 m, t in 0-1, the closed triangle, h in `least_below`-1 m.
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

/// A box of them with D = 1: w = W/D, t, λ_A, λ_C, h/D.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell([Interval; 5]);

/// λ and cable lengths over a cell, D = 1.
struct Shape {
    w: Interval,
    t: Interval,
    lambda: [Interval; 3],
    lengths: [Interval; 3],
    h: Interval,
}

impl Cell {
    fn whole(rigs: &Rigs) -> Self {
        let lambda = Interval::new(rigs.least_lambda, (1.0 - 2.0 * rigs.least_lambda).next_up());
        Self([rigs.width / rigs.depth, rigs.apex, lambda, lambda, rigs.below / rigs.depth])
    }

    /// Whether a rig of `rigs` may be in it.
    fn contains_some(&self, rigs: &Rigs) -> bool {
        let [w, _, a, c, h] = self.0;
        let one = Interval::point(1.0);
        // D is in its range, and so are W = w D and h D.
        let (by_width, by_below) = (rigs.width / w, rigs.below / h);
        let least = rigs.depth.lo.max(by_width.lo).max(by_below.lo);
        let most = rigs.depth.hi.min(by_width.hi).min(by_below.hi);
        least <= most && (one - a - c).hi >= rigs.least_lambda
    }

    fn halves(&self, sizes: [f64; 5]) -> [Self; 2] {
        let size = |k: usize| self.0[k].width() / sizes[k];
        let widest = (0..5).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(0);
        self.0[widest].halves().map(|half| {
            let mut cell = *self;
            cell.0[widest] = half;
            cell
        })
    }

    fn shape(&self, rigs: &Rigs) -> Shape {
        let [w, t, a, c, h] = self.0;
        let one = Interval::point(1.0);
        let b = one - a - c;
        let b = Interval::new(b.lo.max(rigs.least_lambda), b.hi.max(rigs.least_lambda));
        // From A: (w λ_C, λ_B + λ_C (1 - t)); from B: (w λ_C, λ_A + λ_C t); from C: (w (1 - λ_C), (1 - t) λ_A - t λ_B).
        let far = (w * c).square() + h.square();
        let lengths = [
            (far + (b + c * (one - t)).square()).sqrt(),
            (far + (a + c * t).square()).sqrt(),
            ((w * (one - c)).square() + ((one - t) * a - t * b).square() + h.square()).sqrt(),
        ];
        Shape { w, t, lambda: [a, b, c], lengths, h }
    }
}
