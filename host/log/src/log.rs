//! Log of one run: `run.csv`, `lost.csv`, `summary.json` and the figures.

use std::path::{Path, PathBuf};

use plumb_config::escape::escaped;
use plumb_config::whole_writes::{WholeWrites, check_named};
use plumb_frame::source::BoxedError;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer, RunEvent};
use plumb_runtime::run::Summary;
use serde::Serialize;

use super::drawing::draw;
use super::figures::{self, FigureSettings};
use super::output_dir::{create_new, write_new};
use super::row::{columns, row};
use super::samples::{Sample, Samples};
use super::{OutputDir, RunLogError};

/// Observer that writes the log of a run. Every row is handed to the operating system when it is
/// recorded. The end of the run adds the other files.
///
/// Behind a [`BoundedObserver`](plumb_runtime::bounded_observer::BoundedObserver), `run.csv` is
/// complete up to the last frame, also where the run fails or panics. A process that is killed
/// (SIGKILL) loses the rows in the queue.
#[derive(Debug)]
pub struct RunLog {
    path: PathBuf,
    rows: csv::Writer<WholeWrites>,
    lost: LostFrames,
    /// Number of the last frame in `run.csv`.
    last_frame: Option<u64>,
    samples: Samples<Sample>,
    settings: FigureSettings,
    failure: Option<RunLogError>,
    unwritten: Option<RunLogError>,
}

impl RunLog {
    /// Creates the folder, begins `run.csv` in it and writes `figures.json`.
    ///
    /// # Errors
    /// Those of [`OutputDir::create`]; [`RunLogError::Io`].
    pub fn create(folder: &OutputDir, settings: FigureSettings) -> Result<Self, RunLogError> {
        let path = folder.create()?;
        let rows = csv::Writer::from_writer(WholeWrites::new(create_new(&path.join("run.csv"))?));
        let mut log = Self {
            lost: LostFrames::new(&path),
            path,
            rows,
            last_frame: None,
            samples: Samples::new(),
            settings,
            failure: None,
            unwritten: None,
        };
        log.write(columns())?;
        figures::write(&log.path, &log.settings)?;
        Ok(log)
    }

    /// Returns the folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the error of the summary or the figure that could not be written at the end of the
    /// run.
    pub fn unwritten(&self) -> Option<&RunLogError> {
        self.unwritten.as_ref()
    }

    /// Adds the row of a frame, which is in the file when this returns.
    ///
    /// # Errors
    /// [`RunLogError::Csv`] or [`RunLogError::Io`] where it cannot be written (a full disk).
    pub fn record(&mut self, record: &FrameRecord) -> Result<(), RunLogError> {
        self.samples.push(Sample::from(record));
        self.last_frame = Some(record.number);
        self.write(row(record))
    }

    /// Ends the log: writes the rows to the disk and `summary.json`, and draws the figures from the
    /// rows so far.
    ///
    /// # Errors
    /// The first file that cannot be written (a full disk). The others are tried all the same. A
    /// file that was begun and not finished is removed.
    pub fn finish<T: Serialize + ?Sized>(&mut self, summary: &T) -> Result<(), RunLogError> {
        let rows = self.finish_rows();
        rows.and(self.write_result(summary))
    }

    /// Writes the rows so far to the disk.
    fn finish_rows(&mut self) -> Result<(), RunLogError> {
        let flushed = self.rows.flush().and_then(|()| self.rows.get_ref().file().sync_all());
        let kept = flushed.and_then(|()| check_named(self.rows.get_ref().file()));
        kept.map_err(RunLogError::io("finish", self.path.join("run.csv")))
    }

    /// Writes `summary.json` and the figures.
    fn write_result<T: Serialize + ?Sized>(&self, summary: &T) -> Result<(), RunLogError> {
        let written = self.write_summary(summary);
        let samples = self.samples.to_vec();
        let drawn = draw(&self.path, &samples, &self.settings, write_new);
        written.and_then(|()| drawn.into_iter().try_for_each(|figure| figure.map(drop)))
    }

    fn write_summary<T: Serialize + ?Sized>(&self, summary: &T) -> Result<(), RunLogError> {
        let path = self.path.join("summary.json");
        let mut json = serde_json::to_vec_pretty(summary)
            .map_err(|source| RunLogError::Json { path: path.clone(), source })?;
        json.push(b'\n');
        write_new(&path, &json)
    }

    fn write<T: AsRef<[u8]>>(
        &mut self,
        fields: impl IntoIterator<Item = T>,
    ) -> Result<(), RunLogError> {
        let path = || self.path.join("run.csv");
        self.rows
            .write_record(fields)
            .map_err(|error| RunLogError::Csv { path: path(), source: error.into() })?;
        self.rows.flush().map_err(RunLogError::io("write", path()))
    }
}

impl Observer for RunLog {
    fn frame(&mut self, record: &FrameRecord) {
        if let Err(error) = self.record(record) {
            self.failure.get_or_insert(error);
        }
    }

    fn event(&mut self, record: &EventRecord) {
        let RunEvent::FrameLost { message } = &record.event else { return };
        if let Err(error) = self.lost.add(self.last_frame, message) {
            self.failure.get_or_insert(error);
        }
    }

    fn end(&mut self, summary: &Summary) {
        if let Err(error) = self.finish_rows() {
            self.failure.get_or_insert(error);
        }
        self.unwritten = self.write_result(summary).err();
    }

    fn failure(&mut self) -> Option<BoxedError> {
        self.failure.take().map(Into::into)
    }
}

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
        rows.write_record([first, escaped(message)]).map_err(failed)?;
        rows.flush().map_err(RunLogError::io("write", path))
    }
}

#[cfg(test)]
pub(super) mod tests;
