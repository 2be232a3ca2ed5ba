//! Log of several runs of one task, each with another law, and the figure of their errors.

use std::path::{Path, PathBuf};

use super::drawing::write_errors;
use super::samples::LawCurve;
use super::{OutputDir, RunLogError};

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
        let title = "Distance from the target over time, each law in turn";
        write_errors(&path, title, curves, Some(threshold_m)).map(|()| path)
    }
}
