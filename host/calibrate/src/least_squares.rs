//! Nonlinear least squares over a rigid transformation (Levenberg-Marquardt with Huber weights).

use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Translation3, UnitQuaternion, Vector6};

/// Residuals beyond so many standard deviations count linearly (Huber's usual constant: 95 % of
/// the efficiency of least squares for normal residuals).
const HUBER: f64 = 1.345;
/// Iterations after which the search ends.
const MAX_ITERATIONS: usize = 60;
/// Step of the numerical derivatives, metres and radians.
const STEP: f64 = 1e-6;
/// Steps shorter than this end the search, metres and radians.
const LAST_STEP: f64 = 1e-10;
/// Damping at the start, and the largest one that is tried.
const DAMPING: [f64; 2] = [1e-4, 1e8];

/// Minimum of a sum of squares.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Minimum {
    /// The transformation.
    pub(crate) pose: Isometry3<f64>,
    /// Covariance of a small rotation (radians, first three) and shift (metres) that is applied
    /// after the transformation's rotation. It is that of residuals of standard deviation 1, or of
    /// their own if they are larger.
    pub(crate) covariance: Matrix6<f64>,
    /// Sum of the weighted squares.
    pub(crate) cost: f64,
}

impl Minimum {
    /// Returns the standard deviation of the position, metres: the root of the sum over the axes.
    pub(crate) fn position_sd(&self) -> f64 {
        self.covariance.fixed_view::<3, 3>(3, 3).trace().max(0.0).sqrt()
    }

    /// Returns the standard deviation of the rotation, radians: the root of the sum over the axes.
    pub(crate) fn rotation_sd(&self) -> f64 {
        self.covariance.fixed_view::<3, 3>(0, 0).trace().max(0.0).sqrt()
    }
}

/// Returns the transformation with the smallest residuals near `start`. `residuals` are in standard
/// deviations. `None` if they do not determine it.
pub(crate) fn minimise(
    start: Isometry3<f64>,
    residuals: impl Fn(&Isometry3<f64>) -> DVector<f64>,
) -> Option<Minimum> {
    let mut pose = start;
    let mut cost = huber_cost(&residuals(&pose));
    let [mut damping, most] = DAMPING;
    for _ in 0..MAX_ITERATIONS {
        let (normal, gradient) = normal_equations(&pose, &residuals);
        let mut damped = normal;
        for k in 0..6 {
            damped[(k, k)] *= 1.0 + damping;
        }
        let step = damped.cholesky()?.solve(&-gradient);
        let next = moved(&pose, &step);
        let next_cost = huber_cost(&residuals(&next));
        if next_cost <= cost {
            (pose, cost, damping) = (next, next_cost, damping / 10.0);
            if step.norm() < LAST_STEP {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > most {
                break;
            }
        }
    }
    let (normal, _) = normal_equations(&pose, &residuals);
    let freedom = residuals(&pose).len().saturating_sub(6).max(1) as f64;
    let covariance = normal.cholesky()?.inverse() * (cost / freedom).max(1.0);
    (cost.is_finite() && covariance.iter().all(|k| k.is_finite())).then_some(Minimum {
        pose,
        covariance,
        cost,
    })
}

/// Returns `pose` after a small rotation and shift.
fn moved(pose: &Isometry3<f64>, step: &Vector6<f64>) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
    let shift = step.fixed_rows::<3>(3).into_owned();
    Isometry3::from_parts(
        Translation3::from(pose.translation.vector + shift),
        rotation * pose.rotation,
    )
}

/// Returns the weight of a residual in Huber's loss.
fn weight(residual: f64) -> f64 {
    if residual.abs() <= HUBER { 1.0 } else { HUBER / residual.abs() }
}

/// Returns Huber's loss.
fn huber_cost(residuals: &DVector<f64>) -> f64 {
    let loss = |r: f64| {
        if r.abs() <= HUBER { r * r } else { HUBER * (2.0 * r.abs() - HUBER) }
    };
    residuals.iter().map(|&r| loss(r)).sum()
}

/// Returns the weighted normal matrix and gradient at `pose`.
fn normal_equations(
    pose: &Isometry3<f64>,
    residuals: &impl Fn(&Isometry3<f64>) -> DVector<f64>,
) -> (Matrix6<f64>, Vector6<f64>) {
    let at = residuals(pose);
    let mut jacobian = DMatrix::zeros(at.len(), 6);
    for k in 0..6 {
        let step = Vector6::ith(k, STEP);
        let difference = residuals(&moved(pose, &step)) - residuals(&moved(pose, &-step));
        jacobian.set_column(k, &(difference / (2.0 * STEP)));
    }
    let weights = at.map(weight);
    let (mut normal, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
    for (row, (&residual, &weight)) in jacobian.row_iter().zip(at.iter().zip(&weights)) {
        let row: Vector6<f64> = Vector6::from_iterator(row.iter().copied());
        normal += weight * row * row.transpose();
        gradient += weight * residual * row;
    }
    (normal, gradient)
}
