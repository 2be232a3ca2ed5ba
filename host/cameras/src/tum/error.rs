//! Failures to read a TUM RGB-D folder.

use std::path::{Path, PathBuf};

use plumb_config::bounded_read::ReadError;
use plumb_frame::file_intrinsics::UnfitIntrinsics;
use plumb_frame::image::ImageSize;
use plumb_frame::source::{InvalidFrame, SourceError};
use plumb_pictures::decode::DecodeError;
use thiserror::Error;

/// Failure to read a TUM RGB-D folder or one of its frames.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TumError {
    /// The images do not make a frame.
    #[error(transparent)]
    Frame(#[from] InvalidFrame),
    /// A file cannot be read, or is too large.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file is no image that can be decoded, or one of the wrong type of pixels.
    #[error("{}", .path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// Violated condition.
        #[source]
        error: DecodeError,
    },
    /// A list of images is missing.
    #[error(
        "{}: has no {names}: a recording is a folder with lists of pictures, whose lines are \
         `timestamp path` (seconds, then a file){advice}",
        .folder.display()
    )]
    NoList {
        /// The folder.
        folder: PathBuf,
        /// Names that the list may have.
        names: String,
        /// End of the sentence: what else may be meant.
        advice: &'static str,
    },
    /// A list of images has too many lines.
    #[error("{}: it has more than {limit} lines; split the recording", .path.display())]
    TooManyLines {
        /// The list.
        path: PathBuf,
        /// Most lines that are read.
        limit: usize,
    },
    /// A line of a list of images is something else.
    #[error(
        "{}:{line}: {text:?} is not `{form}` (seconds, of at most 1e10, then a file)",
        .path.display()
    )]
    Line {
        /// The list.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// What a line of this list is.
        form: &'static str,
        /// Beginning of the line.
        text: String,
    },
    /// An image differs in size from the first one. The intrinsics hold for one size only.
    #[error("{}: {size}, but the recording's first picture is {first}", .path.display())]
    OtherSize {
        /// The image.
        path: PathBuf,
        /// Size of the image.
        size: ImageSize,
        /// Size of the recording's first image.
        first: ImageSize,
    },
    /// The intrinsics do not fit the images.
    #[error(transparent)]
    UnfitIntrinsics(#[from] UnfitIntrinsics),
}

impl TumError {
    /// Returns the failure to decode the file at `path`.
    pub(super) fn decode(path: &Path, error: DecodeError) -> Self {
        Self::Decode { path: path.to_owned(), error }
    }
}

impl From<TumError> for SourceError {
    fn from(error: TumError) -> Self {
        Self::new(error)
    }
}
