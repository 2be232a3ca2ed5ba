//! Where pictures come from.

use thiserror::Error;

use crate::frame::{FrameError, RgbdFrame};

/// Why a source could not give its next picture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SourceError {
    /// What was read does not make a frame.
    #[error("{what}: {error}")]
    Frame {
        /// Which picture.
        what: String,
        /// What is wrong with it.
        error: FrameError,
    },
}

/// Something that gives pictures with depth, one after the other.
pub trait Source {
    /// The next picture, or `None` at the end of a recording.
    ///
    /// # Errors
    /// Where it could not be had; the source may go on after that with the next one.
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError>;
}
