//! Errors of video files.

use std::io;
use std::path::PathBuf;

use plumb_frame::file_intrinsics::UnfitIntrinsics;
use plumb_frame::image::ImageSize;
use thiserror::Error;

/// Failed call of OpenCV, without its types.
#[derive(Debug, Error)]
#[error(transparent)]
pub struct LibraryError(Box<dyn std::error::Error + Send + Sync>);

impl From<opencv::Error> for LibraryError {
    fn from(error: opencv::Error) -> Self {
        Self(error.into())
    }
}

/// Failure to open a video file, or to read it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum VideoFileError {
    /// The file cannot be opened for reading.
    #[error("{}: cannot be opened", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// OpenCV does not take the file.
    #[error(
        "{}: OpenCV cannot read it: the file is damaged, or of a format that it does not know",
        .path.display()
    )]
    Refused {
        /// The file.
        path: PathBuf,
    },
    /// A picture differs in size from the first one.
    #[error("{}: a picture is {size} where the first one was of another size", .path.display())]
    OtherSize {
        /// The file.
        path: PathBuf,
        /// Size of the picture.
        size: ImageSize,
    },
    /// OpenCV states no time for a picture of a file whose times are uneven.
    #[error("{}: a picture without a time, in a file of uneven times: not used", .path.display())]
    NoTime {
        /// The file.
        path: PathBuf,
    },
    /// A call of OpenCV failed.
    #[error("{}: OpenCV failed", .path.display())]
    Library {
        /// The file.
        path: PathBuf,
        /// Error of OpenCV.
        source: LibraryError,
    },
    /// The intrinsics do not fit the pictures.
    #[error(transparent)]
    UnfitIntrinsics(#[from] UnfitIntrinsics),
}
