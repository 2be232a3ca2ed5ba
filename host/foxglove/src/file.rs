//! The MCAP file.

use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use foxglove::{Context, McapWriterHandle};

use crate::FoxgloveError;

/// First failure to write. The writer of the `foxglove` crate drops the errors of its messages.
type FirstFailure = Arc<Mutex<Option<io::Error>>>;

/// MCAP file that is being written.
pub(crate) struct McapFile {
    path: PathBuf,
    writer: McapWriterHandle<CheckedFile>,
    failure: FirstFailure,
}

impl McapFile {
    /// Creates the file for the channels of `context`.
    ///
    /// # Errors
    /// Where it exists, or cannot be created or begun.
    pub(crate) fn create(context: &Arc<Context>, path: &Path) -> Result<Self, FoxgloveError> {
        let file = File::create_new(path).map_err(|source| match source.kind() {
            ErrorKind::AlreadyExists => FoxgloveError::Exists(path.into()),
            _ => FoxgloveError::Create { path: path.into(), source },
        })?;
        let failure = FirstFailure::default();
        let file = CheckedFile { file: BufWriter::new(file), failure: Arc::clone(&failure) };
        let begun = context.mcap_writer().create(file);
        let writer = begun.map_err(|source| FoxgloveError::Mcap { path: path.into(), source })?;
        Ok(Self { path: path.into(), writer, failure })
    }

    /// Takes the first failure to write, if there was one. The last frame was at `time_s`, seconds.
    pub(crate) fn failure(&self, time_s: f64) -> Option<FoxgloveError> {
        let source = self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()?;
        Some(FoxgloveError::Write { path: self.path.clone(), time_s, source })
    }

    /// Completes the file and writes it to the disk. The last frame was at `time_s`, seconds.
    ///
    /// # Errors
    /// Where it cannot be written, or was removed.
    pub(crate) fn finish(self, time_s: f64) -> Result<(), FoxgloveError> {
        let Self { path, writer, failure } = self;
        let closed = writer.close();
        let first = failure.lock().unwrap_or_else(PoisonError::into_inner).take();
        let write = |source| FoxgloveError::Write { path: path.clone(), time_s, source };
        match (first, closed) {
            (Some(source), _) => Err(write(source)),
            (None, Err(source)) => Err(FoxgloveError::Mcap { path, source }),
            (None, Ok(mut file)) => {
                let synced = file.flush().and_then(|()| file.file.get_ref().sync_all());
                let data = synced.and_then(|()| file.file.get_ref().metadata()).map_err(write)?;
                if data.nlink() == 0 { Err(FoxgloveError::Removed(path)) } else { Ok(()) }
            }
        }
    }
}

/// Buffered file that keeps its first failure.
struct CheckedFile {
    file: BufWriter<File>,
    failure: FirstFailure,
}

impl CheckedFile {
    /// Keeps the error of `result`, if it is the first.
    fn checked<T>(&self, result: io::Result<T>) -> io::Result<T> {
        if let Err(error) = &result
            && error.kind() != ErrorKind::Interrupted
        {
            let copy = error.raw_os_error().map_or_else(
                || io::Error::new(error.kind(), error.to_string()),
                io::Error::from_raw_os_error,
            );
            self.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(copy);
        }
        result
    }
}

impl Write for CheckedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes);
        self.checked(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        let flushed = self.file.flush();
        self.checked(flushed)
    }
}

impl Seek for CheckedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let sought = self.file.seek(to);
        self.checked(sought)
    }
}
