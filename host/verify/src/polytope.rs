//! Theorem 1 in general: families of Jacobians that are given by their vertices.
//!
//! The family is all M = Σ w_k M_k with w >= 0, Σ w = 1. Problem (8): v(e) is the shortest vector
//! among all M'e, the shortest of the convex hull of the M_k'e. By the min-max theorem e'Mv >= |v|²
//! for every M of the family, so that u̇ = -γ v lets |e| fall; and v(e) is not 0 for any e but 0
//! exactly where no M is singular.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverError, SolverStatus,
};
use thiserror::Error;

use super::Interval;
use super::directions::{Patch, determinant, dot, norm, over_directions};
use super::search::within;

/// Entries are at most so large, so that nothing overflows.
const MOST: f64 = 1e9;

/// The gap between primal and dual that the solver is asked for, where the largest coordinate of
/// all M_k'e is 1: as little as it reaches always. Its root, 10⁻⁶, is about the error that is
/// proved.
const GAP: f64 = 1e-12;

/// The least |v| is told to this part of itself.
const TOLERANCE: f64 = 0.05;

/// |v| below this part of the largest entry is looked at as a singular matrix.
const VANISHING: f64 = 1e-6;

/// A family of Jacobians (rows x, y, z; columns A, B, C) by its vertices: at least one, entries of
/// at most 10⁹.
#[derive(Debug, Clone, PartialEq)]
pub struct Polytope {
    vertices: Vec<[[f64; 3]; 3]>,
    largest: f64,
}

/// Why there is no such family, or no v.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PolytopeError {
    /// No vertex.
    #[error(
        "a family needs one vertex at least: a matrix by rows, [[.., .., ..], [.., .., ..], [.., .., ..]]"
    )]
    Empty,
    /// An entry that is no number, or too large.
    #[error(
        "vertex {vertex} (from 1) has the entry {entry}; entries are numbers of at most {MOST:e}"
    )]
    Entry {
        /// Which vertex, from 1.
        vertex: usize,
        /// The entry.
        entry: f64,
    },
    /// The solver would not take the problem.
    #[error("problem (8) was refused by the QP solver: {0}")]
    Refused(#[from] SolverError),
    /// The solver did not come to an end.
    #[error("the QP solver did not solve problem (8): {0}")]
    Unsolved(SolverStatus),
}

/// What solves problem (8).
#[derive(Debug, Clone, PartialEq)]
pub struct MinimumNorm {
    /// v(e), in the units of M'e.
    pub v: [f64; 3],
    /// w: v = Σ w_k M_k'e.
    pub weights: Vec<f64>,
    /// |v - v(e)| is at most this. It does not rest on the solver: with x_k = M_k'e, |v - v(e)|² <= |v|² - min x_k·v,
    /// because v·(v - v(e)) <= |v|² - min x_k·v and v(e)·(v - v(e)) >= 0.
    pub error: f64,
}

/// Whether a family has a singular member.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It has none: proved.
    Nonsingular,
    /// It has one: proved by two members with determinants of opposite signs.
    Singular,
    /// Not decided.
    Open,
}

/// What [`Polytope::robustness`] found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robustness {
    /// Whether v(e) is never 0.
    pub verdict: Verdict,
    /// The least |v(e)|/|e| lies in here.
    pub least_v: Interval,
    /// An e, of length 1, at which it is about reached.
    pub direction: [f64; 3],
    /// Patches of directions that were looked at.
    pub patches: usize,
}

impl Polytope {
    /// The convex hull of `vertices`.
    ///
    /// # Errors
    /// Without vertices, or where an entry is not a number of at most 10⁹.
    pub fn new(vertices: Vec<[[f64; 3]; 3]>) -> Result<Self, PolytopeError> {
        if vertices.is_empty() {
            return Err(PolytopeError::Empty);
        }
        let mut largest: f64 = 0.0;
        for (k, &entry) in vertices
            .iter()
            .enumerate()
            .flat_map(|(k, m)| m.as_flattened().iter().map(move |x| (k, x)))
        {
            if entry.is_nan() || entry.abs() > MOST {
                return Err(PolytopeError::Entry { vertex: k + 1, entry });
            }
            largest = largest.max(entry.abs());
        }
        Ok(Self { vertices, largest })
    }

    /// How many vertices were given.
    #[must_use]
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// Never: there is a vertex.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// v(e), eq. (8).
    ///
    /// # Errors
    /// Where the solver stops without a solution.
    pub fn minimum_norm(&self, e: [f64; 3]) -> Result<MinimumNorm, PolytopeError> {
        let points: Vec<_> = self.vertices.iter().map(|m| transposed_times(m, e)).collect();
        let scale = points.as_flattened().iter().fold(0.0, |s: f64, x| s.max(x.abs()));
        let weights =
            if scale > 0.0 { hull_weights(&points, scale)? } else { vec![1.0; points.len()] };
        let sum: f64 = weights.iter().sum();
        let weights: Vec<_> = weights.into_iter().map(|w| w / sum).collect();
        let v = [0, 1, 2].map(|i| points.iter().zip(&weights).map(|(x, w)| w * x[i]).sum());
        let lowest = points.iter().map(|x| inner(*x, v)).fold(f64::INFINITY, f64::min);
        Ok(MinimumNorm { v, weights, error: (inner(v, v) - lowest).max(0.0).sqrt() })
    }

    /// Whether no member is singular, and the least |v(e)|/|e|, by bisection of the directions of
    /// e.
    ///
    /// The solver proposes, interval arithmetic decides: for any n, |v(e)| >= min e'M_k n / |n|,
    /// which is computed with outward rounding for all e of a patch, with the v of its middle as n.
    #[must_use]
    pub fn robustness(&self, most_patches: usize) -> Robustness {
        let determinants = self.determinants(&vec![0.0; self.len()]);
        let mut singular = opposite(&determinants);
        let vanishing = VANISHING * self.largest;
        let value = |patch: &Patch| {
            let (bound, weights) = self.bound(patch);
            if bound.hi <= vanishing && !singular {
                singular =
                    opposite(&[determinants.as_slice(), &self.determinants(&weights)].concat());
            }
            bound
        };
        let known = |value: Interval| within(TOLERANCE)(value) || value.hi <= vanishing;
        let found = over_directions(value, known, most_patches);
        let (least_v, centre, patches) = found
            .map_or((Interval::point(0.0), [1.0, 0.0, 0.0], 0), |least| {
                (least.value, least.cell.centre(), least.cells)
            });
        let verdict = match (least_v.lo > 0.0, singular) {
            (_, true) => Verdict::Singular,
            (true, false) => Verdict::Nonsingular,
            (false, false) => Verdict::Open,
        };
        let length = inner(centre, centre).sqrt();
        Robustness { verdict, least_v, direction: centre.map(|x| x / length), patches }
    }

    /// What encloses the least |v(e)|/|e| over a patch, and the weights of v in its middle.
    fn bound(&self, patch: &Patch) -> (Interval, Vec<f64>) {
        let (e, centre) = (patch.e(), patch.centre());
        // A direction in which the solver fails stays open.
        let Ok(MinimumNorm { v, weights, .. }) = self.minimum_norm(centre) else {
            return (Interval::new(0.0, f64::INFINITY), vec![0.0; self.len()]);
        };
        let n = v.map(Interval::point);
        let along =
            self.vertices.iter().map(|m| dot(e, m.map(|row| dot(row.map(Interval::point), n))));
        let lowest = along.fold(f64::INFINITY, |lowest, x| lowest.min(x.lo));
        let reached = norm(n) / norm(centre.map(Interval::point));
        let lower = Interval::point(lowest) / (norm(n) * norm(e));
        (Interval::new(if lowest > 0.0 { lower.lo.max(0.0) } else { 0.0 }, reached.hi), weights)
    }

    /// Determinants of what lies between each vertex and S = Σ w_k M_k, near S: of S + M_k/100.
    /// Weights that are not below 0 give a positive multiple of a member, whatever their sum is.
    /// Without weights: of the vertices.
    fn determinants(&self, weights: &[f64]) -> Vec<Interval> {
        let times = |w: f64, m: &[[f64; 3]; 3]| {
            m.map(|row| row.map(|x| Interval::point(w) * Interval::point(x)))
        };
        let plus = |a: [[Interval; 3]; 3], b: [[Interval; 3]; 3]| {
            [0, 1, 2].map(|i| [0, 1, 2].map(|k| a[i][k] + b[i][k]))
        };
        let zero = [[Interval::point(0.0); 3]; 3];
        let sum = self
            .vertices
            .iter()
            .zip(weights)
            .fold(zero, |sum, (m, w)| plus(sum, times(w.max(0.0), m)));
        self.vertices.iter().map(|m| determinant(&plus(sum, times(0.01, m)))).collect()
    }
}

/// Whether there are determinants of both signs.
fn opposite(determinants: &[Interval]) -> bool {
    determinants.iter().any(|d| d.lo > 0.0) && determinants.iter().any(|d| d.hi < 0.0)
}

/// Weights, not normalised, of the shortest vector in the hull of `points`, of which the largest
/// coordinate is `scale`.
///
/// Solved in its dual form, which has four unknowns: min |v|²/2 - t over (v, t) with t <= x_k·v.
/// Its v is the shortest vector, and the multipliers are the weights.
fn hull_weights(points: &[[f64; 3]], scale: f64) -> Result<Vec<f64>, PolytopeError> {
    let count = points.len();
    let objective = CscMatrix::new(4, 4, vec![0, 1, 2, 3, 3], vec![0, 1, 2], vec![1.0; 3]);
    let mut columns: Vec<f64> =
        (0..3).flat_map(|i| points.iter().map(move |x| -x[i] / scale)).collect();
    columns.extend(vec![1.0; count]);
    let starts = (0..=4).map(|k| k * count).collect();
    let constraints =
        CscMatrix::new(count, 4, starts, (0..4).flat_map(|_| 0..count).collect(), columns);
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: GAP,
        tol_gap_rel: GAP,
        tol_feas: GAP,
        ..DefaultSettings::default()
    };
    let linear = [0.0, 0.0, 0.0, -1.0];
    let cones = [NonnegativeConeT(count)];
    let mut solver =
        DefaultSolver::new(&objective, &linear, &constraints, &vec![0.0; count], &cones, settings)?;
    solver.solve();
    let weights: Vec<_> = solver.solution.z.iter().map(|w| w.max(0.0)).collect();
    let sum: f64 = weights.iter().sum();
    // The last digits may be beyond it, which the error that is told shows.
    let ended = matches!(
        solver.solution.status,
        SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress
    );
    if ended && sum.is_finite() && sum > 0.0 {
        Ok(weights)
    } else {
        Err(PolytopeError::Unsolved(solver.solution.status))
    }
}

/// M'e.
fn transposed_times(m: &[[f64; 3]; 3], e: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| (0..3).map(|i| m[i][k] * e[i]).sum())
}

fn inner(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests;
