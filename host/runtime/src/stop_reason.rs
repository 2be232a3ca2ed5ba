//! Reason why a run or the drive to a target ended.

use std::fmt;

use plumb_protocol::message::Fault;
use serde::{Serialize, Serializer};

/// Reason of the end of a run, or of the drive to one target.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StopReason {
    /// The board holds the ball at the target.
    Reached,
    /// The target was not reached within the timeout.
    Timeout,
    /// The board stopped by itself.
    Fault(Fault),
    /// The run was interrupted from outside.
    Interrupted,
    /// The source has no more frames.
    EndOfFrames,
    /// The link, the camera or an observer failed; the messages of the error and its causes.
    Failed(String),
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reached => f.write_str("reached"),
            Self::Timeout => f.write_str("not reached in time"),
            Self::Fault(fault) => write!(f, "the board has stopped by itself: {fault}"),
            Self::Interrupted => f.write_str("interrupted"),
            Self::EndOfFrames => f.write_str("no more pictures"),
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
