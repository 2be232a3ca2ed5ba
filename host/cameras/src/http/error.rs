//! Errors of cameras in the network.

use std::io::{self, ErrorKind};
use std::time::Duration;

use plumb_pictures::decode::DecodeError;
use thiserror::Error;

use super::limits::{MAX_PICTURE_BYTES, PATIENCE};

/// Failure of a camera in the network.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum HttpError {
    /// The settings name no camera.
    #[error("no camera is named: `url = \"http://HOST:PORT/PATH\"` in [camera.http]")]
    NoUrl,
    /// The camera cannot be reached.
    #[error("{url}: cannot be reached")]
    Connect {
        /// Address of the camera.
        url: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The reply has no pictures.
    #[error("{url}: {says}")]
    Reply {
        /// Address of the camera.
        url: String,
        /// What the reply is, and what to do.
        says: String,
    },
    /// The other side speaks no HTTP.
    #[error("what answers speaks no HTTP")]
    NoHttp,
    /// The connection has ended.
    #[error("the camera has ended the connection")]
    Ended,
    /// Nothing, or no whole picture, has come for a while.
    #[error("no whole picture for {} s", PATIENCE.as_secs())]
    Stalled,
    /// A picture is too large.
    #[error("a picture of more than {} MiB", MAX_PICTURE_BYTES >> 20)]
    TooLarge,
    /// The connection fails.
    #[error("the connection fails")]
    Io(#[source] io::Error),
    /// A picture cannot be decoded.
    #[error("a picture cannot be decoded")]
    Decode(#[from] DecodeError),
    /// No picture has come for a while.
    #[error("no picture for {:.0} s", .0.as_secs_f64())]
    Silent(Duration),
}

impl From<io::Error> for HttpError {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            ErrorKind::TimedOut => Self::Stalled,
            ErrorKind::UnexpectedEof | ErrorKind::ConnectionReset => Self::Ended,
            _ => Self::Io(error),
        }
    }
}
