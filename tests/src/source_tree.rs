//! The files of the repository, for tests that check them.

use std::fs;
use std::path::{Component, Path, PathBuf};

/// Folders of the repository that are not source: build output, git's files, run logs.
const SKIPPED_IN_ROOT: [&str; 3] = ["target", ".git", "runs"];

/// Name of the folders of installed packages, wherever they are.
const PACKAGES: &str = "node_modules";

/// Returns the folder of the repository.
pub fn root() -> PathBuf {
    normalise(&Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
}

/// Resolves `.` and `..` without following symbolic links.
pub fn normalise(path: &Path) -> PathBuf {
    let mut found = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                found.pop();
            }
            Component::CurDir => {}
            other => found.push(other),
        }
    }
    found
}

/// Returns the source files below `folder`, a folder of the repository, whose names end in one of
/// `endings`, in order.
///
/// # Panics
/// If a folder cannot be read.
pub fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    collect(folder, endings, &mut found);
    found.sort();
    found
}

fn collect(folder: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for entry in entries {
        let path = entry.expect("a directory entry").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && !path.is_symlink() {
            if !is_skipped(&path) {
                collect(&path, endings, found);
            }
        } else if endings.iter().any(|ending| name.ends_with(ending)) {
            found.push(path);
        }
    }
}

/// Returns whether `folder` holds no source.
fn is_skipped(folder: &Path) -> bool {
    folder.ends_with(PACKAGES) || SKIPPED_IN_ROOT.iter().any(|name| folder == root().join(name))
}

/// Returns the text of a file.
///
/// # Panics
/// If the file cannot be read.
pub fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}
