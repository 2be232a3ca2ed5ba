//! What a run leaves behind: a folder with `run.csv` (a row a frame), `summary.json`, `figure4.svg`
//! (x, y, z and |e| over the frames) and `figure5.svg` (the path in space), named after the paper's
//! figures.

mod error;
mod figures;
mod folder;
mod laws;
mod row;

pub use error::RunError;
pub use folder::{RunFolder, Scene};
pub use laws::{LawCurve, LawsFolder};
pub use row::{Row, RowDetection};
