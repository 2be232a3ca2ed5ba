//! Errors of a recording.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::source::BoxedError;

/// Failure of a recording.
#[derive(Debug, Error)]
pub enum RecordError {
    /// The path exists, and is not an empty folder.
    #[error(
        "{} exists already and is not an empty folder: recordings are never overwritten; give \
         another folder or move it away",
        .0.display()
    )]
    Exists(PathBuf),
    /// A file operation failed.
    #[error("the recording: cannot {action} {}", .path.display())]
    Io {
        /// The operation.
        action: &'static str,
        /// Its file or folder.
        path: PathBuf,
        /// Error of the operating system.
        #[source]
        error: io::Error,
    },
    /// The camera file cannot be written with other intrinsics.
    #[error("the recording: the camera file: {0}")]
    Camera(String),
    /// An image cannot be encoded.
    #[error("the recording: cannot encode {}", .path.display())]
    Encode {
        /// File of the image.
        path: PathBuf,
        /// Error of the encoder.
        #[source]
        error: BoxedError,
    },
    /// The writing thread panicked.
    #[error("the recording's thread broke down")]
    Thread,
}

/// Returns a function that adds operation and path to an error.
pub(super) fn io_error(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> RecordError {
    let path = path.to_owned();
    move |error| RecordError::Io { action, path, error }
}
