//! Run log: a folder with `run.csv` (a row a frame), `summary.json`, `figure4.svg` (x, y, z and |e|
//! over the frames) and `figure5.svg` (the path in space), named after the paper's figures. A run
//! that loses frames has `lost.csv` too (a row a loss).

mod comparison;
mod error;
mod figures;
mod log;
mod lost_frames;
mod output_dir;
mod row;

pub use comparison::{ComparisonLog, LawCurve};
pub use error::RunLogError;
pub use log::{FigureSettings, RunLog};
pub use output_dir::OutputDir;
pub use row::{LogDetection, LogRow};
