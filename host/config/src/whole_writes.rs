//! Files whose records are whole, also where the disk is full.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Writes a file, new or over an old one. A file without room (a full disk, the limit of a file's
/// size) is removed. A file that cannot be opened stays unchanged.
///
/// # Errors
/// Where it cannot be written.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes).inspect_err(|_| {
        // Half a file would look like a whole one.
        let _absent = fs::remove_file(path);
    })
}

/// Writes a file that does not exist yet. A file without room is removed.
///
/// # Errors
/// [`io::ErrorKind::AlreadyExists`] where something has its name; and where it cannot be written.
pub fn write_new(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create_new(path)?;
    file.write_all(bytes).inspect_err(|_| {
        let _absent = fs::remove_file(path);
    })
}

/// Checks that a file which was written still has a name: with its last one its contents are gone.
///
/// # Errors
/// [`io::ErrorKind::NotFound`] where it was removed.
pub fn check_named(file: &File) -> io::Result<()> {
    match file.metadata()?.nlink() {
        0 => Err(io::Error::new(ErrorKind::NotFound, "the file was removed while it was written")),
        _ => Ok(()),
    }
}

/// New file that takes each record by one write. A record without room (a full disk, the limit of a
/// file's size) leaves nothing in the file: those before it are complete.
#[derive(Debug)]
pub struct WholeWrites {
    file: File,
    /// Length of the whole records, bytes.
    length: u64,
}

impl WholeWrites {
    /// Returns the writer of an empty file.
    pub fn new(file: File) -> Self {
        Self { file, length: 0 }
    }

    /// Returns the file.
    pub fn file(&self) -> &File {
        &self.file
    }
}

impl Write for WholeWrites {
    fn write(&mut self, record: &[u8]) -> io::Result<usize> {
        let written = self.file.write_all(record);
        if written.is_err() {
            // The error of the write is the one that counts.
            let _not_cut = self
                .file
                .set_len(self.length)
                .and_then(|()| self.file.seek(SeekFrom::Start(self.length)));
        }
        written?;
        self.length += record.len() as u64;
        Ok(record.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

    use super::*;

    #[test]
    fn a_file_that_was_removed_is_told_from_one_that_was_moved() {
        let folder = tempfile::tempdir().unwrap();
        let [path, moved] = ["a", "b"].map(|name| folder.path().join(name));
        let file = File::create_new(&path).unwrap();
        fs::rename(&path, &moved).unwrap();
        assert!(check_named(&file).is_ok());
        fs::remove_file(&moved).unwrap();
        assert_eq!(check_named(&file).map_err(|error| error.kind()), Err(ErrorKind::NotFound));
    }

    /// A folder behind a link cannot be opened as a file.
    #[test]
    fn what_cannot_be_opened_is_not_removed() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("report");
        std::os::unix::fs::symlink(folder.path(), &link).unwrap();
        assert!(write_whole(&link, b"text").is_err());
        assert!(link.symlink_metadata().is_ok());
    }
}
