//! Corpora: a folder of inputs for each target, in `tests/fuzz/corpus`.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::target::Target;

/// Returns the folder of all corpora.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus")
}

/// Reads the inputs of a target, in the order of their names.
///
/// # Errors
/// Where the folder or a file cannot be read.
pub fn read(folder: &Path, target: &Target) -> io::Result<Vec<Vec<u8>>> {
    let files = fs::read_dir(folder.join(target.name))?;
    let mut paths = files.map(|file| Ok(file?.path())).collect::<io::Result<Vec<_>>>()?;
    paths.sort();
    paths.into_iter().filter(|path| path.is_file()).map(fs::read).collect()
}
