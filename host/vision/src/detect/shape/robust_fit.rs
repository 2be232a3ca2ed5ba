//! Robust least squares for a few unknowns, and the median.

use nalgebra::{SMatrix, SVector};

/// Returns the median of `values`, of an even number of them the upper one in the middle; `None` if
/// there are none.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// One step of iteratively reweighted least squares with Tukey's biweight.
///
/// It minimises Σ w (1 - (r / c)²)² (r - row · step)² over the observations with |r| < c, plus
/// `damping` |step|².
pub(super) struct TukeyStep<const N: usize> {
    cutoff: f64,
    normal: SMatrix<f64, N, N>,
    right: SVector<f64, N>,
    squares: f64,
    weights: f64,
    inliers: usize,
}

/// Result of a [`TukeyStep`].
pub(super) struct Solution<const N: usize> {
    /// The unknowns.
    pub(super) step: SVector<f64, N>,
    /// Inverse of the normal matrix: the covariance for residuals of variance 1.
    pub(super) inverse: SMatrix<f64, N, N>,
    /// Weighted mean of the squared residuals after the step.
    pub(super) mean_square: f64,
}

impl<const N: usize> TukeyStep<N> {
    /// Starts a step with the cut-off `cutoff`, in the unit of the residuals, and the weight
    /// `damping` of a step of zero.
    pub(super) fn new(cutoff: f64, damping: f64) -> Self {
        let (normal, right) = (SMatrix::identity() * damping, SVector::zeros());
        Self { cutoff, normal, right, squares: 0.0, weights: 0.0, inliers: 0 }
    }

    /// Adds an observation: the derivative of its residual by the unknowns, the residual, and its
    /// weight.
    #[inline]
    pub(super) fn add(&mut self, row: SVector<f64, N>, residual: f64, weight: f64) {
        let relative = residual / self.cutoff;
        if relative.abs() >= 1.0 {
            return;
        }
        let weight = weight * (1.0 - relative * relative).powi(2);
        self.normal += row * row.transpose() * weight;
        self.right += row * residual * weight;
        self.squares += residual * residual * weight;
        self.weights += weight;
        self.inliers += 1;
    }

    /// Adds prior knowledge of the third unknown: its value and the weight of that.
    pub(super) fn add_prior(&mut self, value: f64, weight: f64) {
        self.normal[(2, 2)] += weight;
        self.right[2] += value * weight;
    }

    /// Returns the sum of the observations' weights.
    pub(super) fn weights(&self) -> f64 {
        self.weights
    }

    /// Returns the number of observations within the cut-off.
    pub(super) fn inliers(&self) -> usize {
        self.inliers
    }

    /// Solves for the unknowns; `None` if they are not determined.
    pub(super) fn solve(&self) -> Option<Solution<N>> {
        let inverse = self.normal.try_inverse()?;
        let step = inverse * self.right;
        let mean_square = (self.squares - step.dot(&self.right)).max(0.0) / self.weights;
        Some(Solution { step, inverse, mean_square })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn a_circle_is_fitted_despite_outliers() {
        let truth = Vector3::new(0.3, -0.2, 0.5);
        let mut fit = TukeyStep::new(4.0, 1e-9);
        for ray in 0..40 {
            let (sin, cos) = (TAU * f64::from(ray) / 40.0).sin_cos();
            let row = Vector3::new(cos, sin, 1.0);
            let outlier = if ray % 5 == 0 { 10.0 } else { 0.0 };
            fit.add(row, row.dot(&truth) + outlier, 1.0);
        }
        let solution = fit.solve().unwrap();
        assert_eq!(fit.inliers(), 32);
        assert!((solution.step - truth).norm() < 1e-6, "{}", solution.step);
        assert!(solution.mean_square < 1e-9);
    }

    #[test]
    fn a_prior_counts_as_much_as_its_weight() {
        let mut fit = TukeyStep::new(1e9, 1e-12);
        for row in [Vector3::x(), Vector3::y(), Vector3::z()] {
            fit.add(row, 1.0, 1.0);
        }
        fit.add_prior(4.0, 2.0);
        let step = fit.solve().unwrap().step;
        assert!((step - Vector3::new(1.0, 1.0, 3.0)).norm() < 1e-6, "{step}");
    }

    #[test]
    fn nothing_determines_nothing() {
        assert!(TukeyStep::<3>::new(1.0, 0.0).solve().is_none());
    }
}
