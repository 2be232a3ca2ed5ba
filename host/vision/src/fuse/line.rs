//! A straight line that is learned from samples and may drift.

use nalgebra::{Matrix2, Vector2};

/// Factor of a sample's variance: neighbouring pictures share a part of their errors.
const CORRELATED: f64 = 4.0;

/// Deviations from the line beyond which a sample counts less.
const MAX_DEVIATIONS: f64 = 3.0;

/// Longest time between two samples that adds drift, seconds.
const MAX_GAP_S: f64 = 10.0;

/// Recursive least squares of `y = offset + slope x` with a prior, robust against outliers.
#[derive(Debug, Clone)]
pub(super) struct Line {
    /// Offset and slope.
    mean: Vector2<f64>,
    covariance: Matrix2<f64>,
    /// Growth of the two variances in a second.
    drift: Vector2<f64>,
    /// Time of the last sample, seconds.
    stamp: Option<f64>,
}

impl Line {
    /// Creates the line y = 0 with these standard deviations of offset and slope, and of their
    /// drift in a second.
    pub(super) fn new(deviations: [f64; 2], drift: [f64; 2]) -> Self {
        let variances = Vector2::from(deviations.map(|it| it * it));
        let drift = drift.map(|it| it * it).into();
        let covariance = Matrix2::from_diagonal(&variances);
        Self { mean: Vector2::zeros(), covariance, drift, stamp: None }
    }

    /// Returns the line at `x` and its variance.
    pub(super) fn at(&self, x: f64) -> (f64, f64) {
        let row = Vector2::new(1.0, x);
        (self.mean.dot(&row), row.dot(&(self.covariance * row)))
    }

    /// Returns the slope and its standard deviation.
    pub(super) fn slope(&self) -> (f64, f64) {
        (self.mean.y, self.covariance[(1, 1)].sqrt())
    }

    /// Adds a sample with this variance, taken at `stamp`.
    pub(super) fn update(&mut self, stamp: f64, (x, y): (f64, f64), variance: f64) {
        let gap = self.stamp.map_or(0.0, |last| (stamp - last).clamp(0.0, MAX_GAP_S));
        self.stamp = Some(stamp);
        self.covariance += Matrix2::from_diagonal(&(self.drift * gap));
        let (expected, expected_variance) = self.at(x);
        let innovation = y - expected;
        let variance = (CORRELATED * variance).max((innovation / MAX_DEVIATIONS).powi(2));
        let row = Vector2::new(1.0, x);
        let gain = self.covariance * row / (variance + expected_variance);
        let next = self.covariance - gain * (self.covariance * row).transpose();
        if (innovation * gain).iter().chain(next.iter()).all(|it| it.is_finite()) {
            self.mean += gain * innovation;
            self.covariance = (next + next.transpose()) / 2.0;
        }
    }
}
