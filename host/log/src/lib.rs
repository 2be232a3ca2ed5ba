//! Run log: a folder with `run.csv` (a row a frame), `summary.json`, `figure4.svg` (x, y, z and |e|
//! over the time) and `figure5.svg` (the path in space), named after the paper's figures. A run
//! that loses frames has `lost.csv` too (a row a loss). `figures.json` has what the figures show
//! besides the rows, so that [`LoggedRun`] can draw them again. [`RunPictures`] adds the first and
//! the last picture.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod comparison;
mod drawing;
mod figures;
mod log;
mod logged_run;
mod output_dir;
mod pictures;
pub mod plot_axis;
pub mod plot_colours;
pub mod replay;
mod row;
mod samples;

use std::path::PathBuf;

use plotters::drawing::DrawingAreaErrorKind;
use plumb_frame::source::BoxedError;
use thiserror::Error;

pub use comparison::ComparisonLog;
pub use figures::FigureSettings;
pub use log::RunLog;
pub use logged_run::{LoggedRun, compare};
pub use output_dir::OutputDir;
pub use pictures::{FIRST_PICTURE, LAST_PICTURE, RunPictures};
pub use row::columns;
pub use samples::LawCurve;

/// Failure to create or write the run log.
#[derive(Debug, Error)]
pub enum RunLogError {
    /// The folder exists and is not empty: a run is never overwritten.
    #[error(
        "{} exists already and is not an empty folder: runs are never overwritten; give another \
         folder or move it away",
        .0.display()
    )]
    Exists(PathBuf),
    /// The file of a figure exists: no file is overwritten.
    #[error(
        "{} exists already: files are never overwritten; give another file or remove it",
        .0.display()
    )]
    FileExists(PathBuf),
    /// The parent folder holds more numbered runs than there are numbers.
    #[error("no free run number under {} for '{prefix}'; move old runs away", .parent.display())]
    NoFreeNumber {
        /// Folder of the runs.
        parent: PathBuf,
        /// First part of the name.
        prefix: String,
    },
    /// An operation on a file failed.
    #[error("cannot {action} {}", .path.display())]
    Io {
        /// The operation.
        action: &'static str,
        /// Its file or folder.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// A row could not be written.
    #[error("cannot write a row to {}", .path.display())]
    Csv {
        /// The CSV file.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// The summary cannot be turned into JSON.
    #[error("cannot write the summary to {}", .path.display())]
    Json {
        /// The JSON file.
        path: PathBuf,
        /// Cause.
        source: serde_json::Error,
    },
    /// The folder is not that of a run, or its files have another content.
    #[error(
        "{} is not a folder of a run that can be drawn; name one run, such as runs/run-0001",
        .folder.display()
    )]
    NotARun {
        /// The folder.
        folder: PathBuf,
        /// Cause.
        source: BoxedError,
    },
    /// A figure could not be drawn.
    #[error("cannot draw {}", .path.display())]
    Figure {
        /// The SVG file.
        path: PathBuf,
        /// Cause.
        source: DrawingAreaErrorKind<std::io::Error>,
    },
    /// A picture could not be encoded.
    #[error("cannot encode {}", .path.display())]
    Picture {
        /// The JPEG file.
        path: PathBuf,
        /// Cause.
        source: BoxedError,
    },
}

impl RunLogError {
    /// Returns a function for `map_err` that names the operation and its path.
    pub(crate) fn io(
        action: &'static str,
        path: impl Into<PathBuf>,
    ) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { action, path, source }
    }
}
