//! Correction of the state by a measurement, its score and its outliers.
#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns go by their numbers in several arrays at once"
)]

use super::Filter;
use crate::law::taut::geometry::Vector;
use crate::law::taut::prior::{DELAY, N};

/// Variance that the filter's model leaves out, mm².
const UNMODELLED_VARIANCE_MM2: f32 = 4.0;
/// Factor on the score from measurement to measurement: a memory of 200.
const SCORE_MEMORY: f32 = 0.995;
/// Innovation of an outlier, standard deviations.
const OUTLIER_SIGMAS: f32 = 4.0;
/// Outliers in a row that are skipped.
const MAX_SKIPPED: u8 = 2;
/// Score of a skipped measurement: that of an axis at the edge of [`OUTLIER_SIGMAS`].
const SKIPPED_SCORE: f32 = 30.0;
/// Highest score of a measurement.
const MAX_SCORE: f32 = 60.0;
/// Factor on the mean innovation from measurement to measurement: a memory of 10.
const BIAS_MEMORY: f32 = 0.9;
/// Weight of a measurement in the mean innovation.
const BIAS_WEIGHT: f32 = 0.1;

impl Filter {
    /// Corrects the first `corrected` entries of the state by a ball at `z`, one coordinate after
    /// the other. The others keep their uncertainty (Schmidt's filter).
    pub(super) fn correct(&mut self, z: Vector, corrected: usize) {
        if !self.accepts(z) {
            return;
        }
        let mut surprise = 0.0;
        for i in 0..3 {
            let variance = self.variance(i);
            let precision = 1.0 / variance;
            let off = self.innovation(z, i);
            surprise += off * off * precision + libm::logf(variance);
            self.bias[i] = BIAS_MEMORY * self.bias[i] + BIAS_WEIGHT * off / libm::sqrtf(variance);
            let row: [f32; N] =
                core::array::from_fn(|k| self.p[i][k] - self.moved[i] * self.p[DELAY][k]);
            for k in 0..corrected {
                let gain = row[k] * precision;
                self.x[k] += gain * off;
                // P is symmetric: the lower triangle is copied.
                for l in k..N {
                    self.p[k][l] -= gain * row[l];
                    self.p[l][k] = self.p[k][l];
                }
            }
        }
        self.score = SCORE_MEMORY * self.score + surprise.min(MAX_SCORE);
    }

    /// Returns whether a measurement of the ball at `z` is to be used. Outliers are skipped. After
    /// [`MAX_SKIPPED`] in a row the ball has really moved: the variance of its position grows, and
    /// the geometry stays.
    fn accepts(&mut self, z: Vector) -> bool {
        let off = [0, 1, 2].map(|i| self.innovation(z, i));
        let outlier =
            [0, 1, 2].map(|i| off[i] * off[i] > OUTLIER_SIGMAS * OUTLIER_SIGMAS * self.variance(i));
        if outlier == [false; 3] {
            self.outliers = 0;
            return true;
        }
        self.outliers = self.outliers.saturating_add(1);
        if self.outliers <= MAX_SKIPPED {
            self.score = SCORE_MEMORY * self.score + SKIPPED_SCORE;
            return false;
        }
        for i in 0..3 {
            if outlier[i] {
                self.p[i][i] += off[i] * off[i];
            }
        }
        true
    }

    /// Returns the innovation of a ball at `z` along an axis, mm: the prediction is the position
    /// before the measurement's delay.
    fn innovation(&self, z: Vector, axis: usize) -> f32 {
        z[axis] - (self.x[axis] - self.moved[axis] * self.x[DELAY])
    }

    /// Returns the variance of the innovation along an axis, mm².
    fn variance(&self, axis: usize) -> f32 {
        let moved = self.moved[axis];
        let late = moved * (moved * self.p[DELAY][DELAY] - 2.0 * self.p[axis][DELAY]);
        (self.p[axis][axis] + late).max(0.0) + self.variances[axis] + UNMODELLED_VARIANCE_MM2
    }
}
