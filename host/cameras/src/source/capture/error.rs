//! Errors of a capture.

use std::io;
use std::time::Duration;

use thiserror::Error;

/// Failure of the thread that reads a source.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// The source has delivered neither a frame nor an error for this long.
    #[error(
        "the camera has delivered nothing for {:.1} s and does not answer; unplug it and plug it \
         in again",
        .0.as_secs_f64()
    )]
    Blocked(Duration),
    /// The source has panicked, with this message.
    #[error("the camera's driver has panicked: {0}; please report this as a defect of Plumb")]
    Panicked(String),
}

/// Failure to start a capture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StartCaptureError {
    /// The source does not run in real time.
    #[error("this source has no clock of its own: only a camera can be read in a thread")]
    NoClock,
    /// The operating system starts no thread.
    #[error("cannot start the thread that reads the camera")]
    Thread(#[source] io::Error),
}
