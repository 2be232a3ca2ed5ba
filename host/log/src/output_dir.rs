//! Folder that a run writes to.

use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use plumb_config::whole_writes;

use super::RunLogError;

/// Highest number of a numbered folder.
const LAST_NUMBER: u32 = 9999;

/// Choice of the folder that a run writes to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OutputDir {
    /// This folder, which must be new or empty. A symbolic link to an empty folder is that folder.
    Path(PathBuf),
    /// A new folder `PREFIX-0001`, `PREFIX-0002`, ... under `parent`, one above the highest there.
    Numbered {
        /// The folder of all runs.
        parent: PathBuf,
        /// First part of the folder's name.
        prefix: &'static str,
    },
}

impl OutputDir {
    /// Checks that the folder is new or empty, and creates nothing.
    ///
    /// # Errors
    /// [`RunLogError::Exists`] where something is there that is not an empty folder.
    pub fn check(&self) -> Result<(), RunLogError> {
        let Self::Path(path) = self else { return Ok(()) };
        let is_free = match fs::read_dir(path) {
            Ok(mut entries) => entries.next().is_none(),
            Err(error) if error.kind() == ErrorKind::NotFound => true,
            Err(error) if error.kind() == ErrorKind::NotADirectory => false,
            Err(error) => return Err(RunLogError::io("look into", path)(error)),
        };
        if is_free { Ok(()) } else { Err(RunLogError::Exists(path.clone())) }
    }

    /// Creates the folder, and those above it. Returns its path.
    ///
    /// # Errors
    /// [`RunLogError::Exists`] where something is there that is not an empty folder;
    /// [`RunLogError::NoFreeNumber`] after 9999; [`RunLogError::Io`].
    pub fn create(&self) -> Result<PathBuf, RunLogError> {
        match self {
            Self::Path(path) => new_folder(path.clone()),
            Self::Numbered { parent, prefix } => numbered_folder(parent, prefix),
        }
    }
}

/// Creates the folder `path` and those above it. It must be empty if it exists. A symbolic link to
/// an empty folder is that folder.
fn new_folder(path: PathBuf) -> Result<PathBuf, RunLogError> {
    if let Err(source) = fs::create_dir_all(&path) {
        // The path exists and is not a folder.
        return Err(match path.symlink_metadata() {
            Ok(_) => RunLogError::Exists(path),
            Err(_) => RunLogError::Io { action: "create the folder", path, source },
        });
    }
    let mut entries = fs::read_dir(&path).map_err(RunLogError::io("look into", &path))?;
    if entries.next().is_some() { Err(RunLogError::Exists(path)) } else { Ok(path) }
}

/// Creates the folder of the next free number under `parent`.
fn numbered_folder(parent: &Path, prefix: &str) -> Result<PathBuf, RunLogError> {
    fs::create_dir_all(parent).map_err(RunLogError::io("create the folder", parent))?;
    for number in highest_number(parent, prefix)?.saturating_add(1)..=LAST_NUMBER {
        let path = parent.join(format!("{prefix}-{number:04}"));
        match fs::create_dir(&path) {
            Ok(()) => return Ok(path),
            // Another run took it just now.
            Err(source) if source.kind() == ErrorKind::AlreadyExists => {}
            Err(source) => {
                return Err(RunLogError::Io { action: "create the folder", path, source });
            }
        }
    }
    Err(RunLogError::NoFreeNumber { parent: parent.into(), prefix: prefix.into() })
}

/// Returns the highest number of a folder or file `PREFIX-NUMBER` in `parent`, or 0.
fn highest_number(parent: &Path, prefix: &str) -> Result<u32, RunLogError> {
    let mut highest = 0;
    for entry in fs::read_dir(parent).map_err(RunLogError::io("look into", parent))? {
        let name = entry.map_err(RunLogError::io("look into", parent))?.file_name();
        let number = name
            .to_str()
            .and_then(|name| name.strip_prefix(prefix)?.strip_prefix('-')?.parse::<u32>().ok());
        highest = highest.max(number.unwrap_or(0));
    }
    Ok(highest)
}

/// Creates a file that did not exist.
pub(super) fn create_new(path: &Path) -> Result<File, RunLogError> {
    File::create_new(path).map_err(not_new("create", path))
}

/// Writes a file that did not exist, whole or not at all.
pub(super) fn write_new(path: &Path, bytes: &[u8]) -> Result<(), RunLogError> {
    whole_writes::write_new(path, bytes).map_err(not_new("write", path))
}

/// Returns a function for `map_err` of an operation that needs a new `path`.
fn not_new(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> RunLogError {
    move |source| match source.kind() {
        ErrorKind::AlreadyExists => RunLogError::FileExists(path.into()),
        _ => RunLogError::io(action, path)(source),
    }
}

/// Writes a file in place of the one of this name, whole or not at all.
pub(super) fn replace(path: &Path, bytes: &[u8]) -> Result<(), RunLogError> {
    let new = path.with_extension("new");
    let written = fs::write(&new, bytes).and_then(|()| fs::rename(&new, path));
    written.map_err(|source| {
        let _ = fs::remove_file(&new);
        RunLogError::io("write", path)(source)
    })
}
