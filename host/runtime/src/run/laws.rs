//! The folder of several runs of one task, each with another law, and the figure of their errors.

use std::path::{Path, PathBuf};

use super::RunError;
use super::figures::errors_over_time;
use super::folder::{new_folder, numbered_folder, write_new};

/// How a law did.
#[derive(Debug, Clone, PartialEq)]
pub struct LawCurve {
    /// What it is called in the figure.
    pub law: String,
    /// Seconds since the run's start, and |e| in metres; in the order of time.
    pub points: Vec<(f64, f64)>,
}

/// The folder.
#[derive(Debug)]
pub struct LawsFolder(PathBuf);

impl LawsFolder {
    /// As [`RunFolder::create`](super::RunFolder::create).
    ///
    /// # Errors
    /// [`RunError::Exists`] where there is something that is not an empty folder; [`RunError::Io`].
    pub fn create(path: impl Into<PathBuf>) -> Result<Self, RunError> {
        new_folder(path.into()).map(Self)
    }

    /// As [`RunFolder::create_numbered`](super::RunFolder::create_numbered).
    ///
    /// # Errors
    /// [`RunError::NoFreeNumber`] after 9999; [`RunError::Io`].
    pub fn create_numbered(parent: impl AsRef<Path>, prefix: &str) -> Result<Self, RunError> {
        numbered_folder(parent.as_ref(), prefix).map(Self)
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Draws `laws.svg`; its path.
    ///
    /// # Errors
    /// Where it cannot be drawn or written.
    pub fn finish(self, curves: &[LawCurve], threshold_m: f64) -> Result<PathBuf, RunError> {
        let path = self.0.join("laws.svg");
        match errors_over_time(curves, threshold_m) {
            Ok(svg) => write_new(&path, svg.as_bytes()).map(|()| path),
            Err(source) => Err(RunError::Figure { path, source }),
        }
    }
}
