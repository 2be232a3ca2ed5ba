//! Log of several runs of one task, each with another law, and the figure of their errors.

use std::path::{Path, PathBuf};

use super::figures::errors_over_time;
use super::output_dir::write_new;
use super::{OutputDir, RunLogError};
use crate::observer::{FrameRecord, Observer};

/// Observer that collects the error of a run over time, for one curve of the figure.
#[derive(Debug, Clone, PartialEq)]
pub struct LawCurve {
    /// Name of the curve.
    pub law: String,
    /// Seconds since the run's start, and |e| in metres; in the order of time.
    pub points: Vec<(f64, f64)>,
}

impl LawCurve {
    /// Returns a curve without points.
    pub fn new(law: String) -> Self {
        Self { law, points: Vec::new() }
    }
}

impl Observer for LawCurve {
    fn frame(&mut self, record: &FrameRecord) {
        self.points.extend(record.error().map(|error| (record.time, error)));
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
        match errors_over_time("Error over time, each law", curves, Some(threshold_m)) {
            Ok(svg) => write_new(&path, svg.as_bytes()).map(|()| path),
            Err(source) => Err(RunLogError::Figure { path, source }),
        }
    }
}
