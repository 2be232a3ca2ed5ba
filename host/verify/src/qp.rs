//! The minimum-norm point of a convex hull, by the QP solver clarabel.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverError, SolverStatus,
};
use plumb_protocol::{MOTORS, PerMotor};
use thiserror::Error;

/// Tolerance of the duality gap if the largest coordinate of the points is 1: the smallest that the
/// solver always reaches. Its square root, 10⁻⁶, is about the proved error.
const GAP: f64 = 1e-12;

/// Solution of problem (8).
#[derive(Debug, Clone, PartialEq)]
pub struct MinimumNorm {
    /// v(e), in the unit of M'e.
    pub v: PerMotor<f64>,
    /// w: v = Σ w_k M_k'e, with w >= 0 and Σ w = 1.
    pub weights: Vec<f64>,
    /// Upper bound of |v - v(e)|, which does not depend on the solver.
    ///
    /// With x_k = M_k'e, |v - v(e)|² <= |v|² - min x_k·v, because v·(v - v(e)) <= |v|² - min
    /// x_k·v and v(e)·(v - v(e)) >= 0.
    pub error: f64,
}

/// Failure of the QP solver.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum QpError {
    /// The solver rejected the problem.
    #[error("the QP solver rejected problem (8)")]
    Rejected(#[from] SolverError),
    /// The solver stopped without a solution.
    #[error("the QP solver did not solve problem (8): {0}")]
    Unsolved(SolverStatus),
}

/// Returns the shortest vector in the convex hull of `points`.
pub(super) fn minimum_norm(points: &[PerMotor<f64>]) -> Result<MinimumNorm, QpError> {
    let scale = points.as_flattened().iter().fold(0.0, |s: f64, x| s.max(x.abs()));
    let weights = if scale > 0.0 { hull_weights(points, scale)? } else { vec![1.0; points.len()] };
    let sum: f64 = weights.iter().sum();
    let weights: Vec<_> = weights.into_iter().map(|w| w / sum).collect();
    let v = std::array::from_fn(|i| points.iter().zip(&weights).map(|(x, w)| w * x[i]).sum());
    let lowest = points.iter().map(|x| inner(*x, v)).fold(f64::INFINITY, f64::min);
    Ok(MinimumNorm { v, weights, error: (inner(v, v) - lowest).max(0.0).sqrt() })
}

/// Returns the weights, not normalised, of the shortest vector in the hull of `points`, whose
/// largest coordinate is `scale`.
///
/// The dual problem has four unknowns: min |v|²/2 - t over (v, t) with t <= x_k·v. Its v is the
/// shortest vector, and its multipliers are the weights.
fn hull_weights(points: &[PerMotor<f64>], scale: f64) -> Result<Vec<f64>, QpError> {
    let count = points.len();
    let objective = CscMatrix::new(4, 4, vec![0, 1, 2, 3, 3], vec![0, 1, 2], vec![1.0; 3]);
    let mut columns: Vec<f64> =
        (0..MOTORS).flat_map(|i| points.iter().map(move |x| -x[i] / scale)).collect();
    columns.extend(vec![1.0; count]);
    let starts = (0..=4).map(|k| k * count).collect();
    let rows = (0..4).flat_map(|_| 0..count).collect();
    let constraints = CscMatrix::new(count, 4, starts, rows, columns);
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
    // `MinimumNorm::error` shows how accurate an almost solved problem is.
    let ended = matches!(
        solver.solution.status,
        SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress
    );
    if ended && sum.is_finite() && sum > 0.0 {
        Ok(weights)
    } else {
        Err(QpError::Unsolved(solver.solution.status))
    }
}

/// Returns a · b.
pub(super) fn inner(a: PerMotor<f64>, b: PerMotor<f64>) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
