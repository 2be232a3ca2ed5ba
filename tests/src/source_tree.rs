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

/// Returns the lines of code of a Rust file with their numbers, from 1: neither blank, nor
/// comments, nor modules of tests.
pub fn code_lines(text: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let mut lines = (1..).zip(text.lines()).peekable();
    while let Some((number, line)) = lines.next() {
        let indent = line.len() - line.trim_start().len();
        let begins_tests = |(_, next): &(usize, &str)| {
            next.trim_start().starts_with("mod ") && next.ends_with('{')
        };
        if line.trim() == "#[cfg(test)]" && lines.peek().is_some_and(begins_tests) {
            let end = format!("{:indent$}}}", "");
            lines.by_ref().take_while(|(_, line)| *line != end).for_each(drop);
        } else if !line.trim().is_empty() && !line.trim_start().starts_with("//") {
            found.push((number, line));
        }
    }
    found
}

/// Returns whether a Rust file, by its path in the repository, has tests only: it is in no folder
/// `src`, or in a module of tests.
pub fn is_test(path: &Path) -> bool {
    let is_module = path.iter().any(|name| name == "tests" || name == "tests.rs");
    is_module || !path.iter().any(|name| name == "src")
}
