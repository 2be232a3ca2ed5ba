//! The files that a run has written, for the browsers to keep.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

/// Path of the files, before their names.
const FOLDER: &str = "/files/";

/// Highest number of bytes of all files: the log of 3 hours. The rest stays in the run folder.
const MOST_BYTES: u64 = 64 << 20;

/// Names of the files that a run writes into its folder, and their types. Nothing else is served.
const NAMES: &[(&str, &str)] = &[
    ("summary.json", "application/json"),
    ("first.jpg", "image/jpeg"),
    ("last.jpg", "image/jpeg"),
    ("figure4.svg", "image/svg+xml"),
    ("figure5.svg", "image/svg+xml"),
    ("deviation.svg", "image/svg+xml"),
    ("figures.json", "application/json"),
    ("lost.csv", "text/csv; charset=utf-8"),
    ("run.csv", "text/csv; charset=utf-8"),
];

/// A file of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RunFile {
    pub(crate) name: &'static str,
    pub(crate) content_type: &'static str,
    pub(crate) body: Arc<[u8]>,
}

/// A file of a run, as the page lists it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct FileView {
    pub(crate) name: &'static str,
    pub(crate) bytes: usize,
}

/// The files of a run that has ended. A browser asks for them by their names, and no name leads to
/// another file: the content is in memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct RunFiles(Vec<RunFile>);

impl RunFiles {
    /// Reads the files of a run folder. What is missing, cannot be read, is no plain file or has no
    /// room is left out.
    pub(crate) fn read(folder: &Path) -> Self {
        let mut room = MOST_BYTES;
        let mut read = |&(name, content_type): &(&'static str, &'static str)| {
            let path = folder.join(name);
            let about = fs::symlink_metadata(&path).ok()?;
            room = about.is_file().then(|| room.checked_sub(about.len())).flatten()?;
            let body = fs::read(&path).ok()?.into();
            Some(RunFile { name, content_type, body })
        };
        Self(NAMES.iter().filter_map(&mut read).collect())
    }

    /// Returns the list of the files.
    pub(crate) fn list(&self) -> Vec<FileView> {
        self.0.iter().map(|file| FileView { name: file.name, bytes: file.body.len() }).collect()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the file at a path of the page's address.
    pub(crate) fn find(&self, path: &str) -> Option<RunFile> {
        let name = path.strip_prefix(FOLDER)?;
        self.0.iter().find(|file| file.name == name).cloned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_files_of_a_run_are_read_and_found() {
        let folder = std::env::temp_dir().join(format!("plumb-page-files-{}", std::process::id()));
        fs::create_dir_all(folder.join("figure4.svg")).unwrap();
        for name in ["run.csv", "summary.json", "secret.txt"] {
            fs::write(folder.join(name), name).unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(folder.join("secret.txt"), folder.join("lost.csv")).unwrap();
        let files = RunFiles::read(&folder);
        fs::remove_dir_all(&folder).unwrap();
        let names: Vec<_> = files.list().iter().map(|file| file.name).collect();
        assert_eq!(names, ["summary.json", "run.csv"]);
        assert_eq!(&*files.find("/files/run.csv").unwrap().body, b"run.csv");
        for path in
            ["/files/", "/run.csv", "/files/secret.txt", "/files/../run.csv", "/files//run.csv"]
        {
            assert_eq!(files.find(path), None, "{path}");
        }
        assert!(RunFiles::read(Path::new("/nowhere")).is_empty());
    }
}
