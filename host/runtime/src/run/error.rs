//! Failures of a run and of its control loop.

use plumb_config::error_chain::ErrorChain;
use plumb_frame::detect::DetectError;
use plumb_frame::source::{BoxedError, SourceError};
use thiserror::Error;

use super::repetition::RepeatedPicture;
use crate::board_fault::BoardFault;
use crate::link::LinkError;
use crate::rig::{MotionError, OutOfRange, Outside};
use crate::stop_reason::StopReason;
use crate::summary::Summary;

/// Failure of the control loop. The message names the part that failed; the source is its error.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ControlLoopError {
    /// The link to the board failed.
    #[error("link to the board")]
    Link(#[from] LinkError),
    /// The camera delivers no frames any more, or lost too many in a row.
    #[error("camera")]
    Source(#[from] SourceError),
    /// The board lost the ball's position, because the camera repeats one picture.
    #[error("camera")]
    Repeated(#[from] RepeatedPicture),
    /// The detector failed on too many frames in a row.
    #[error("detector")]
    Detect(#[from] DetectError),
    /// An observer cannot go on.
    #[error("output of the run")]
    Observer(#[source] BoxedError),
}

impl ControlLoopError {
    /// Returns the reason of the end of a run or a drive that this error ended. A `fault` that the
    /// board reported before its link broke, or because the camera repeats one picture, is the
    /// reason.
    pub(super) fn ending(&self, fault: Option<BoardFault>) -> StopReason {
        match (self, fault) {
            (Self::Link(_) | Self::Repeated(_), Some(fault)) => StopReason::Fault(fault),
            _ => StopReason::Failed(ErrorChain(self).to_string()),
        }
    }
}

/// Failure of a run. A message does not contain that of its source
/// ([`ErrorChain`] joins them).
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunError {
    /// A value of the rig file is beyond what the board can be sent.
    #[error("rig file")]
    Config(#[source] OutOfRange),
    /// Targets are outside the workspace of the rig file; all of them, metres, each with the first
    /// of its coordinates that is outside.
    #[error(
        "the {} outside the workspace of the rig file: {}",
        targets(.0.iter().map(|(target, _)| target)),
        outsides(.0)
    )]
    TargetsOutside(Vec<([f64; 3], Outside)>),
    /// Targets are outside the triangle of the motors; all of them, metres.
    #[error("the {} outside the triangle of the motors, where a cable is slack", targets(.0))]
    TargetsSlack(Vec<[f64; 3]>),
    /// The rig file allows no place at all.
    #[error(transparent)]
    NoPlace(MotionError),
    /// A target is in a wrong part of the picture.
    #[error(transparent)]
    Picture(MotionError),
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
    #[error("connection to the board")]
    Connect(#[source] LinkError),
    /// The run failed after it had begun.
    #[error("the run failed")]
    Broken {
        /// Cause of the failure.
        #[source]
        error: ControlLoopError,
        /// Summary of the run until then.
        summary: Box<Summary>,
    },
}

/// Returns subject and verb of a sentence about targets, metres.
fn targets<'a>(targets: impl IntoIterator<Item = &'a [f64; 3]>) -> String {
    let list: Vec<String> = targets.into_iter().map(|target| format!("{target:?}")).collect();
    match &list[..] {
        [target] => format!("target {target} m is"),
        list => format!("targets {} m are", list.join(", ")),
    }
}

/// Returns the coordinates of targets that are outside the workspace.
fn outsides(targets: &[([f64; 3], Outside)]) -> String {
    targets.iter().map(|(_, outside)| outside.to_string()).collect::<Vec<_>>().join("; ")
}
