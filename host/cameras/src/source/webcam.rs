//! Webcams and video files (the crate `plumb-webcam`, with the feature `webcam`).

mod settings;
#[cfg(feature = "webcam")]
mod source;

use thiserror::Error;

pub use settings::{PixelFormat, PixelFormatError, WebcamSettings};
#[cfg(feature = "webcam")]
pub use source::{VideoFileSource, WebcamSource, WebcamSourceError};

/// Endings of the names of video files, in lower case.
pub(super) const VIDEO_ENDINGS: [&str; 7] = ["avi", "mp4", "m4v", "mkv", "mov", "mpg", "webm"];

/// A program that is built without the feature `webcam`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "this program is built without webcams and video files; build it again with \
     `cargo build --release -p plumb --features webcam`"
)]
pub struct NotBuilt;
