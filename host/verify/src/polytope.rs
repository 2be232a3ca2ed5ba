//! Theorem 1 for polytopes of Jacobians, which are given by their vertices.
//!
//! The family is all M = Σ w_k M_k with w >= 0, Σ w = 1. Problem (8): v(e) is the shortest vector
//! in the convex hull of the M_k'e. By the min-max theorem e'Mv >= |v|² for every M of the family,
//! so that u̇ = -γ v decreases |e|. No M is singular if and only if v(e) is not 0 for any e other
//! than 0.

use plumb_protocol::{AXES, MOTORS, PerAxis, PerMotor};
use thiserror::Error;

use super::Interval;
use super::branch_and_bound::relative_width;
use super::qp::{MinimumNorm, QpError, inner, minimum_norm};
use crate::branch_and_bound::{Patch, minimise_over_directions};
use crate::interval_matrix::{determinant, dot, norm};

/// Largest absolute value of an entry, so that no product overflows.
const MAX_ENTRY: f64 = 1e9;

/// Relative width of the enclosure of min |v|.
const TOLERANCE: f64 = 0.05;

/// Value of |v|, relative to the largest entry, below which the search for a singular member
/// starts.
const VANISHING: f64 = 1e-6;

/// Weight of a vertex beside S = Σ w_k M_k in [`Polytope::determinants`].
const VERTEX_WEIGHT: f64 = 0.01;

/// The convex hull of at least one Jacobian (rows x, y, z; columns A, B, C), entries of at most
/// 10⁹.
#[derive(Debug, Clone, PartialEq)]
pub struct Polytope {
    vertices: Vec<PerAxis<PerMotor<f64>>>,
    /// Largest absolute value of an entry.
    largest: f64,
}

/// Reason why vertices do not describe a polytope.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PolytopeError {
    /// No vertex.
    #[error(
        "a family needs at least one vertex: \
         a matrix by rows, [[.., .., ..], [.., .., ..], [.., .., ..]]"
    )]
    Empty,
    /// An entry that is not a number or is too large.
    #[error(
        "vertex {vertex} (from 1) has the entry {entry}; \
         entries are numbers of at most {MAX_ENTRY:e}"
    )]
    Entry {
        /// Number of the vertex, from 1.
        vertex: usize,
        /// The entry.
        entry: f64,
    },
}

/// Whether a family has a singular member.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nonsingularity {
    /// No member is singular: proved.
    Proved,
    /// A member is singular: proved by two members with determinants of opposite signs.
    Refuted,
    /// Neither was proved.
    Undecided,
}

/// Result of [`Polytope::robustness`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robustness {
    /// Whether every member is nonsingular.
    pub nonsingularity: Nonsingularity,
    /// Enclosure of the minimum of |v(e)|/|e|.
    pub min_v: Interval,
    /// Unit vector e near the minimum.
    pub direction: PerAxis<f64>,
    /// Number of patches of directions visited.
    pub patches: usize,
}

impl Polytope {
    /// Returns the convex hull of `vertices`.
    ///
    /// # Errors
    /// [`PolytopeError`] if there is no vertex, or if an entry is not a number of at most 10⁹.
    pub fn new(vertices: Vec<PerAxis<PerMotor<f64>>>) -> Result<Self, PolytopeError> {
        if vertices.is_empty() {
            return Err(PolytopeError::Empty);
        }
        let mut largest: f64 = 0.0;
        for (k, &entry) in vertices
            .iter()
            .enumerate()
            .flat_map(|(k, m)| m.as_flattened().iter().map(move |x| (k, x)))
        {
            if entry.is_nan() || entry.abs() > MAX_ENTRY {
                return Err(PolytopeError::Entry { vertex: k + 1, entry });
            }
            largest = largest.max(entry.abs());
        }
        Ok(Self { vertices, largest })
    }

    /// Returns the number of vertices given.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// Solves problem (8): returns v(e), its weights and its error.
    ///
    /// # Errors
    /// [`QpError`] if the solver stops without a solution.
    pub fn minimum_norm(&self, e: PerAxis<f64>) -> Result<MinimumNorm, QpError> {
        let points: Vec<_> = self.vertices.iter().map(|m| transposed_times(m, e)).collect();
        minimum_norm(&points)
    }

    /// Decides whether a member is singular, and encloses the minimum of |v(e)|/|e|, by branch and
    /// bound over at most `max_patches` patches of directions of e.
    ///
    /// The solver proposes, interval arithmetic verifies: for any n, |v(e)| >= min e'M_k n / |n|.
    /// The right side is computed with outward rounding for all e of a patch, with n = v at the
    /// centre of the patch.
    #[must_use]
    pub fn robustness(&self, max_patches: usize) -> Robustness {
        let vertex_determinants = self.determinants(&vec![0.0; self.vertex_count()]);
        let mut singular = have_both_signs(&vertex_determinants);
        let vanishing = VANISHING * self.largest;
        let enclosure = |patch: &Patch| {
            let (bound, weights) = self.bound(patch);
            if bound.hi <= vanishing && !singular {
                let near = self.determinants(&weights);
                singular = have_both_signs(&[vertex_determinants.as_slice(), &near].concat());
            }
            bound
        };
        let converged = |value: Interval| relative_width(TOLERANCE)(value) || value.hi <= vanishing;
        let found = minimise_over_directions(enclosure, converged, max_patches);
        let (min_v, centre, patches) = found
            .map_or((Interval::point(0.0), [1.0, 0.0, 0.0], 0), |minimum| {
                (minimum.value, minimum.cell.centre(), minimum.cells)
            });
        let nonsingularity = match (min_v.lo > 0.0, singular) {
            (_, true) => Nonsingularity::Refuted,
            (true, false) => Nonsingularity::Proved,
            (false, false) => Nonsingularity::Undecided,
        };
        let length = inner(centre, centre).sqrt();
        Robustness { nonsingularity, min_v, direction: centre.map(|x| x / length), patches }
    }

    /// Encloses the minimum of |v(e)|/|e| over a patch; also returns the weights of v at its
    /// centre.
    ///
    /// If the solver fails, the enclosure is all numbers from 0.
    fn bound(&self, patch: &Patch) -> (Interval, Vec<f64>) {
        let (e, centre) = (patch.e(), patch.centre());
        let Ok(MinimumNorm { v, weights, .. }) = self.minimum_norm(centre) else {
            return (Interval::new(0.0, f64::INFINITY), vec![0.0; self.vertex_count()]);
        };
        let n = v.map(Interval::point);
        let along =
            self.vertices.iter().map(|m| dot(e, m.map(|row| dot(row.map(Interval::point), n))));
        let lowest = along.fold(f64::INFINITY, |lowest, x| lowest.min(x.lo));
        let reached = norm(n) / norm(centre.map(Interval::point));
        let lower = Interval::point(lowest) / (norm(n) * norm(e));
        (Interval::new(if lowest > 0.0 { lower.lo.max(0.0) } else { 0.0 }, reached.hi), weights)
    }

    /// Returns the determinants of S + M_k/100 for every vertex M_k, where S = Σ w_k M_k.
    ///
    /// Each matrix is a positive multiple of a member near S, whatever the sum of the weights is;
    /// negative weights count as 0. If all weights are 0, it is a multiple of the vertex.
    fn determinants(&self, weights: &[f64]) -> Vec<Interval> {
        let times = |w: f64, m: &PerAxis<PerMotor<f64>>| {
            m.map(|row| row.map(|x| Interval::point(w) * Interval::point(x)))
        };
        let plus = |a: PerAxis<PerMotor<Interval>>, b: PerAxis<PerMotor<Interval>>| {
            std::array::from_fn(|i| std::array::from_fn(|k| a[i][k] + b[i][k]))
        };
        let zero = [[Interval::point(0.0); MOTORS]; AXES];
        let weighted = self.vertices.iter().zip(weights);
        let sum = weighted.fold(zero, |sum, (m, w)| plus(sum, times(w.max(0.0), m)));
        let near_sum = |m| determinant(&plus(sum, times(VERTEX_WEIGHT, m)));
        self.vertices.iter().map(near_sum).collect()
    }
}

/// Checks that there are determinants of both signs.
fn have_both_signs(determinants: &[Interval]) -> bool {
    determinants.iter().any(|d| d.lo > 0.0) && determinants.iter().any(|d| d.hi < 0.0)
}

/// Returns M'e.
fn transposed_times(m: &PerAxis<PerMotor<f64>>, e: PerAxis<f64>) -> PerMotor<f64> {
    std::array::from_fn(|k| (0..AXES).map(|i| m[i][k] * e[i]).sum())
}

#[cfg(test)]
mod tests;
