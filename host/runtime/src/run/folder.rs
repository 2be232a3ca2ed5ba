//! The folder of one run.

use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use nalgebra::Point3;
use serde::Serialize;

use super::figures::{self, Sample};
use super::{Row, RunError};

/// Numbered runs go from 1 to this.
const LAST_NUMBER: u32 = 9999;

/// What the figures show besides the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Title of the figures: the law, its gain and the like.
    pub title: String,
    /// |e| below which the target counts as reached, metres.
    pub threshold_m: f64,
    /// Where the motors are, metres in the rig frame, where that is known.
    pub motors: Option<[Point3<f64>; 3]>,
}

/// The folder of a run that is going on. Every row is handed to the operating system when it is
/// recorded, so that `run.csv` is complete up to the last frame however the run ends;
/// [`RunFolder::finish`] adds the rest.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    rows: csv::Writer<File>,
    samples: Vec<Sample>,
    scene: Scene,
}

impl RunFolder {
    /// Makes the folder `path` (and those above it) and begins `run.csv` in it.
    ///
    /// # Errors
    /// [`RunError::Exists`] where there is something that is not an empty folder; [`RunError::Io`].
    pub fn create(path: impl Into<PathBuf>, scene: Scene) -> Result<Self, RunError> {
        Self::begin(new_folder(path.into())?, scene)
    }

    /// Makes a new folder `PREFIX-0001`, `PREFIX-0002`, ... under `parent`, one above the highest
    /// there is.
    ///
    /// # Errors
    /// [`RunError::NoFreeNumber`] after 9999; [`RunError::Io`].
    pub fn create_numbered(
        parent: impl AsRef<Path>,
        prefix: &str,
        scene: Scene,
    ) -> Result<Self, RunError> {
        Self::begin(numbered_folder(parent.as_ref(), prefix)?, scene)
    }

    fn begin(path: PathBuf, scene: Scene) -> Result<Self, RunError> {
        let file = create_new(&path.join("run.csv"))?;
        let mut folder =
            Self { path, rows: csv::Writer::from_writer(file), samples: Vec::new(), scene };
        folder.write(Row::HEADER)?;
        Ok(folder)
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a row, which is in the file when this returns.
    ///
    /// # Errors
    /// [`RunError::Csv`] or [`RunError::Io`] where it cannot be written (a full disk).
    pub fn record(&mut self, row: &Row) -> Result<(), RunError> {
        self.samples.push(Sample::from(row));
        self.write(row.fields())
    }

    /// Ends the run, well or badly: writes `summary.json` and draws the figures from the rows so
    /// far.
    ///
    /// # Errors
    /// The first file that cannot be written (a full disk). The others are tried all the same, and
    /// no file is left that was begun and not ended: what is there is whole.
    pub fn finish<T: Serialize + ?Sized>(self, summary: &T) -> Result<(), RunError> {
        let written = [
            self.write_summary(summary),
            self.draw("figure4.svg", figures::over_frames),
            self.draw("figure5.svg", figures::in_space),
        ];
        let rows = self.path.join("run.csv");
        let synced = match self.rows.into_inner() {
            Ok(file) => file.sync_all().map_err(RunError::io("finish", &rows)),
            Err(error) => Err(RunError::io("finish", &rows)(error.into_error())),
        };
        written.into_iter().chain([synced]).collect()
    }

    fn write_summary<T: Serialize + ?Sized>(&self, summary: &T) -> Result<(), RunError> {
        let path = self.path.join("summary.json");
        let mut json = serde_json::to_vec_pretty(summary)
            .map_err(|source| RunError::Json { path: path.clone(), source })?;
        json.push(b'\n');
        write_new(&path, &json)
    }

    fn draw(
        &self,
        name: &str,
        figure: fn(&[Sample], &Scene) -> Result<String, figures::DrawError>,
    ) -> Result<(), RunError> {
        let path = self.path.join(name);
        match figure(&self.samples, &self.scene) {
            Ok(svg) => write_new(&path, svg.as_bytes()),
            Err(source) => Err(RunError::Figure { path, source }),
        }
    }

    fn write<T: AsRef<[u8]>>(
        &mut self,
        fields: impl IntoIterator<Item = T>,
    ) -> Result<(), RunError> {
        let path = || self.path.join("run.csv");
        self.rows.write_record(fields).map_err(|source| RunError::Csv { path: path(), source })?;
        self.rows.flush().map_err(RunError::io("write", path()))
    }
}

/// Makes the folder `path` and those above it; it must not hold anything.
pub(super) fn new_folder(path: PathBuf) -> Result<PathBuf, RunError> {
    if let Err(source) = fs::create_dir_all(&path) {
        // Something is in the way that is not a folder.
        return Err(match path.symlink_metadata() {
            Ok(_) => RunError::Exists(path),
            Err(_) => RunError::Io { action: "create the run folder", path, source },
        });
    }
    let mut entries = fs::read_dir(&path).map_err(RunError::io("look into", &path))?;
    if entries.next().is_some() { Err(RunError::Exists(path)) } else { Ok(path) }
}

/// Makes the folder of the next free number under `parent`.
pub(super) fn numbered_folder(parent: &Path, prefix: &str) -> Result<PathBuf, RunError> {
    fs::create_dir_all(parent).map_err(RunError::io("create the folder of runs", parent))?;
    for number in highest_number(parent, prefix)?.saturating_add(1)..=LAST_NUMBER {
        let path = parent.join(format!("{prefix}-{number:04}"));
        match fs::create_dir(&path) {
            Ok(()) => return Ok(path),
            // Another run took it just now.
            Err(source) if source.kind() == ErrorKind::AlreadyExists => {}
            Err(source) => {
                return Err(RunError::Io { action: "create the run folder", path, source });
            }
        }
    }
    Err(RunError::NoFreeNumber { parent: parent.into(), prefix: prefix.into() })
}

/// The highest number of a folder or file `PREFIX-NUMBER` in `parent`; 0 where there is none.
fn highest_number(parent: &Path, prefix: &str) -> Result<u32, RunError> {
    let mut highest = 0;
    for entry in fs::read_dir(parent).map_err(RunError::io("look into", parent))? {
        let name = entry.map_err(RunError::io("look into", parent))?.file_name();
        let number = name
            .to_str()
            .and_then(|name| name.strip_prefix(prefix)?.strip_prefix('-')?.parse::<u32>().ok());
        highest = highest.max(number.unwrap_or(0));
    }
    Ok(highest)
}

/// A file that was not there before.
fn create_new(path: &Path) -> Result<File, RunError> {
    File::create_new(path).map_err(|source| match source.kind() {
        ErrorKind::AlreadyExists => RunError::Exists(path.into()),
        _ => RunError::Io { action: "create", path: path.into(), source },
    })
}

/// Writes a file that was not there before, whole or not at all.
pub(super) fn write_new(path: &Path, bytes: &[u8]) -> Result<(), RunError> {
    let mut file = create_new(path)?;
    file.write_all(bytes).map_err(|source| {
        // Half of it would look like a result.
        let _ = fs::remove_file(path);
        RunError::io("write", path)(source)
    })
}

#[cfg(test)]
mod tests;
