//! Reason why a run or the drive to a target ended.

use std::fmt;

use serde::{Serialize, Serializer};

use crate::board_fault::BoardFault;
use crate::doubt::Doubt;

/// Reason of the end of a run, or of the drive to one target.
#[derive(Debug, Clone, PartialEq)]
pub enum StopReason {
    /// The board holds the ball at the target.
    Reached,
    /// The ball hung at the target before a motor had moved it.
    AlreadyThere,
    /// The target was not reached within the timeout.
    Timeout,
    /// The board stopped by itself.
    Fault(BoardFault),
    /// The run was interrupted from outside.
    Interrupted,
    /// The operator stopped the drive.
    Stopped,
    /// The operator holds the ball where it is.
    Held,
    /// The operator set another target.
    Replaced,
    /// The operator ended the run.
    Ended,
    /// The source has no more frames.
    EndOfFrames,
    /// The stream of targets ended before it had one.
    NoTarget,
    /// The stream of targets ended because its lines could not be used, or the last ones were left
    /// out.
    TargetsBroken,
    /// The last targets of the stream were in places that are not possible, up to its end or for
    /// the time of the timeout.
    TargetsRefused,
    /// The stream of targets had some, and the board has followed none for the time of the timeout.
    TargetsNotFollowed,
    /// The stream of targets had none for the time of the timeout.
    TargetsSilent,
    /// The measured positions cannot be believed.
    Doubt(Doubt),
    /// The link, the camera or an observer failed; the messages of the error and its causes.
    Failed(String),
}

impl StopReason {
    /// Returns the fault for which the board stopped by itself, if that is the reason.
    pub fn fault(&self) -> Option<BoardFault> {
        match self {
            Self::Fault(fault) => Some(*fault),
            _ => None,
        }
    }

    /// Returns whether the ball is at its target.
    pub fn is_arrival(&self) -> bool {
        matches!(self, Self::Reached | Self::AlreadyThere)
    }

    /// Returns what to do next, in words for people; `None` where nothing is wrong.
    pub fn advice(&self) -> Option<&'static str> {
        match self {
            Self::Timeout => Some(
                "If the ball was still moving, give it a longer --timeout. If it had come to rest \
                 beside the target, a cable is slack or another law holds it better",
            ),
            Self::TargetsSilent => Some(
                "Start the program that sends the targets, or look whether it still does so. \
                 Between two targets there may be --timeout seconds at most",
            ),
            Self::TargetsNotFollowed => Some(
                "The board follows a target once it knows where the ball is. Look whether the ball \
                 is in view, and whether the link to the board is slow",
            ),
            Self::TargetsRefused => Some(
                "A message above names a refused place and its limit. Send places within the \
                 workspace, in metres of the rig frame",
            ),
            Self::TargetsBroken => Some(
                "A message above says why, and in which line. Correct the program that sends them",
            ),
            Self::Fault(fault) => Some(fault.advice()),
            Self::Doubt(doubt) => Some(doubt.advice()),
            Self::EndOfFrames => Some(
                "A recording that has ended drives no further. Of a live camera, look at its plug \
                 and at the program that delivers its pictures",
            ),
            _ => None,
        }
    }

    /// Returns whether a person ended the drive, with a command or a signal.
    pub fn is_chosen(&self) -> bool {
        matches!(
            self,
            Self::Interrupted | Self::Stopped | Self::Held | Self::Replaced | Self::Ended
        )
    }
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reached => f.write_str("reached"),
            Self::AlreadyThere => f.write_str("already there: no motor has moved the ball"),
            Self::Timeout => f.write_str("not reached in time"),
            Self::Fault(fault) => write!(f, "the board has stopped by itself: {fault}"),
            Self::Interrupted => f.write_str("interrupted"),
            Self::Stopped => f.write_str("stopped by the operator"),
            Self::Held => f.write_str("held by the operator"),
            Self::Replaced => f.write_str("replaced by another target"),
            Self::Ended => f.write_str("ended by the operator"),
            Self::EndOfFrames => f.write_str("no more pictures"),
            Self::NoTarget => f.write_str("the targets ended before there was one to drive to"),
            Self::TargetsBroken => f.write_str("the lines of the targets could not be used"),
            Self::TargetsRefused => f.write_str("the newest targets were refused for their places"),
            Self::TargetsNotFollowed => {
                f.write_str("targets came, and the board followed none of them in time")
            }
            Self::TargetsSilent => f.write_str("no target came in time"),
            Self::Doubt(doubt) => doubt.fmt(f),
            Self::Failed(message) => f.write_str(message),
        }
    }
}

/// As the text of its `Display`.
impl Serialize for StopReason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
