//! Run log: a folder with `run.csv` (a row a frame), `summary.json`, `figure4.svg` (x, y, z and |e|
//! over the frames) and `figure5.svg` (the path in space), named after the paper's figures. A run
//! that loses frames has `lost.csv` too (a row a loss). `figures.json` has what the figures show
//! besides the rows, so that [`LoggedRun`] can draw them again.

mod comparison;
mod error;
mod figures;
mod figures_file;
mod log;
mod logged_run;
mod lost_frames;
mod output_dir;
mod row;

pub use comparison::{ComparisonLog, LawCurve};
pub use error::RunLogError;
pub use log::{FigureSettings, RunLog};
pub use logged_run::{LoggedRun, compare};
pub use output_dir::OutputDir;
pub use row::{LogDetection, LogPath, LogRow};
