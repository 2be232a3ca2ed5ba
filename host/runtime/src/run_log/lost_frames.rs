//! `lost.csv`: the frames that were lost or could not be searched.

use std::path::{Path, PathBuf};

use plumb_config::whole_writes::WholeWrites;

use super::RunLogError;
use super::output_dir::create_new;

/// Name of the file in the folder of the run.
const FILE: &str = "lost.csv";

/// Header of the file: the number of the last frame in `run.csv` before the loss (empty if there
/// is none), and the message of the error.
const HEADER: [&str; 2] = ["after_frame", "message"];

/// Writer of `lost.csv`. A run that loses no frame has no such file.
#[derive(Debug)]
pub(super) struct LostFrames {
    path: PathBuf,
    rows: Option<csv::Writer<WholeWrites>>,
}

impl LostFrames {
    /// Returns the writer for the run in `folder`.
    pub(super) fn new(folder: &Path) -> Self {
        Self { path: folder.join(FILE), rows: None }
    }

    /// Adds a row, which is in the file when this returns.
    ///
    /// # Errors
    /// Where the file cannot be created or written (a full disk).
    pub(super) fn add(
        &mut self,
        after_frame: Option<u64>,
        message: &str,
    ) -> Result<(), RunLogError> {
        let first = after_frame.map(|number| number.to_string()).unwrap_or_default();
        let path = &self.path;
        let failed =
            |error: csv::Error| RunLogError::Csv { path: path.clone(), source: error.into() };
        let rows = match &mut self.rows {
            Some(rows) => rows,
            none => {
                let rows =
                    none.insert(csv::Writer::from_writer(WholeWrites::new(create_new(path)?)));
                rows.write_record(HEADER).map_err(failed)?;
                rows
            }
        };
        rows.write_record([first.as_str(), message]).map_err(failed)?;
        rows.flush().map_err(RunLogError::io("write", path))
    }
}
