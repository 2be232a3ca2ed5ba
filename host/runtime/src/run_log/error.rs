//! What can go wrong with a run's folder.

use std::path::PathBuf;

use plotters::drawing::DrawingAreaErrorKind;
use thiserror::Error;

/// Why a run's folder could not be made or written.
#[derive(Debug, Error)]
pub enum RunLogError {
    /// There is something already: a run is never overwritten.
    #[error("{} exists already and is not an empty folder: runs are never overwritten; give another folder or move it away", .0.display())]
    Exists(PathBuf),
    /// The parent folder holds more numbered runs than there are numbers.
    #[error("no free run number under {} for '{prefix}'; move old runs away", .parent.display())]
    NoFreeNumber {
        /// Where the folder was to be made.
        parent: PathBuf,
        /// What its name was to begin with.
        prefix: String,
    },
    /// The file system refused.
    #[error("cannot {action} {}: {source}", .path.display())]
    Io {
        /// What was to be done.
        action: &'static str,
        /// To what.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// A row could not be written.
    #[error("cannot write a row to {}: {source}", .path.display())]
    Csv {
        /// The CSV file.
        path: PathBuf,
        /// Why not.
        source: csv::Error,
    },
    /// The summary cannot be turned into JSON.
    #[error("cannot write the summary to {}: {source}", .path.display())]
    Json {
        /// The JSON file.
        path: PathBuf,
        /// Why not.
        source: serde_json::Error,
    },
    /// A figure could not be drawn.
    #[error("cannot draw {}: {source}", .path.display())]
    Figure {
        /// The SVG file.
        path: PathBuf,
        /// Why not.
        source: DrawingAreaErrorKind<std::io::Error>,
    },
}

impl RunLogError {
    /// For `map_err`: names what was to be done to which path.
    pub(crate) fn io(
        action: &'static str,
        path: impl Into<PathBuf>,
    ) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { action, path, source }
    }
}
