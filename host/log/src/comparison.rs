//! Log of several runs of one task, each with another law, and the figure of their errors.

use std::path::{Path, PathBuf};

use super::figures::{HasError, Samples, errors_over_time};
use super::output_dir::write_new;
use super::{OutputDir, RunLogError};
use plumb_runtime::observer::{FrameRecord, Observer};

/// Observer that collects the error of a run over time, for one curve of the figure. Of a long run
/// it keeps the largest errors.
#[derive(Debug, Clone, PartialEq)]
pub struct LawCurve {
    /// Name of the curve.
    law: String,
    points: Samples<CurvePoint>,
}

/// Point of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CurvePoint {
    /// Time since the run's start, seconds.
    time_s: f64,
    /// |e|, metres.
    error_m: f64,
}

impl HasError for CurvePoint {
    fn error_m(&self) -> Option<f64> {
        Some(self.error_m)
    }
}

impl LawCurve {
    /// Returns a curve without points.
    pub fn new(law: String) -> Self {
        Self { law, points: Samples::new() }
    }

    /// Adds a point: seconds since the run's start, and |e| in metres.
    pub(super) fn add(&mut self, time_s: f64, error_m: f64) {
        self.points.push(CurvePoint { time_s, error_m });
    }

    /// Returns the curve with another name.
    pub(super) fn named(self, law: String) -> Self {
        Self { law, ..self }
    }

    /// Returns the name.
    pub(super) fn law(&self) -> &str {
        &self.law
    }

    /// Returns the points in the order of time: seconds since the run's start, and |e| in metres.
    pub(super) fn points(&self) -> Vec<(f64, f64)> {
        self.points.to_vec().iter().map(|point| (point.time_s, point.error_m)).collect()
    }
}

impl Observer for LawCurve {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(error) = record.error() {
            self.add(record.time, error);
        }
    }
}

/// Log of several runs: their folder, and the figure of their errors in it.
#[derive(Debug)]
pub struct ComparisonLog(PathBuf);

impl ComparisonLog {
    /// Creates the folder.
    ///
    /// # Errors
    /// Those of [`OutputDir::create`].
    pub fn create(folder: &OutputDir) -> Result<Self, RunLogError> {
        folder.create().map(Self)
    }

    /// Returns the folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Draws `laws.svg`. Returns its path.
    ///
    /// # Errors
    /// Where it cannot be drawn or written.
    pub fn finish(self, curves: &[LawCurve], threshold_m: f64) -> Result<PathBuf, RunLogError> {
        let path = self.0.join("laws.svg");
        match errors_over_time(
            "Distance from the target over time, each law in turn",
            curves,
            Some(threshold_m),
        ) {
            Ok(svg) => write_new(&path, svg.as_bytes()).map(|()| path),
            Err(source) => Err(RunLogError::Figure { path, source }),
        }
    }
}
