//! Errors of a run.

use plumb_cameras::source::{BoxedError, SourceError};
use plumb_vision::detect::DetectError;
use thiserror::Error;

use crate::link::LinkError;
use crate::rig::OutOfRange;
use crate::summary::Summary;

/// Failure of the control loop.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ControlLoopError {
    /// The link to the board failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The camera delivers no frames any more, or lost too many in a row.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The detector failed on too many frames in a row.
    #[error(transparent)]
    Detect(#[from] DetectError),
    /// An observer cannot go on.
    #[error(transparent)]
    Observer(BoxedError),
}

/// Failure of a run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunError {
    /// A value of the rig file is beyond what the board can be sent.
    #[error("rig file: {0}")]
    Config(#[source] OutOfRange),
    /// A target is outside the workspace of the rig file.
    #[error("the target {0:?} m is outside the workspace of the rig file")]
    TargetOutside([f64; 3]),
    /// The rig file has no targets.
    #[error("the rig file has no targets: list them as `targets = [[x, y, z], ...]`, metres")]
    NoTargets,
    /// The source does not show the present: it is a recording that is read at any speed.
    #[error(
        "the source of the frames is not live: a recording must be played at the speed of its \
         camera to drive a board"
    )]
    NotLive,
    /// The board did not answer, or refused the configuration.
    #[error(transparent)]
    Connect(LinkError),
    /// The run failed after it had begun.
    #[error("{error}")]
    Broken {
        /// Cause of the failure.
        #[source]
        error: Box<ControlLoopError>,
        /// Summary of the run until then.
        summary: Box<Summary>,
    },
}
