//! Errors of positions.

use nalgebra::Point3;
use plumb_vision::observation::Gaussian3;

use super::super::stats::percentile;
use super::report::ErrorReport;

/// Errors of positions against the truth.
#[derive(Debug, Default)]
pub(super) struct Errors {
    /// Distances, millimetres.
    distances: Vec<f64>,
    /// Sum of e'C⁻¹e.
    normalised: f64,
}

impl Errors {
    /// Adds a position and the true place.
    pub(super) fn add(&mut self, found: &Gaussian3, place: &Point3<f64>) {
        let error = found.mean - place;
        self.distances.push(1e3 * error.norm());
        let inverse = found.covariance.try_inverse();
        self.normalised += inverse.map_or(f64::INFINITY, |inverse| error.dot(&(inverse * error)));
    }

    /// Returns their statistics.
    pub(super) fn report(mut self) -> ErrorReport {
        let count = self.distances.len().max(1) as f64;
        let squares: f64 = self.distances.iter().map(|it| it * it).sum();
        let mut share = |share| percentile(&mut self.distances, share).unwrap_or(0.0);
        ErrorReport {
            median_mm: share(0.5),
            p95_mm: share(0.95),
            p99_mm: share(0.99),
            rms_mm: (squares / count).sqrt(),
            consistency: self.normalised / count,
            positions: self.distances.len(),
        }
    }
}
