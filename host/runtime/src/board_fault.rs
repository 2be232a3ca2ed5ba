//! The fault of a board, and the cause that this program has counted.

use std::fmt;
use std::time::Duration;

use plumb_protocol::message::Fault;

use crate::advice::after_fault;

/// Fault for which the board stopped by itself. Its text is for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoardFault {
    /// Fault that the board reports.
    pub fault: Fault,
    /// Its cause, where this program has counted one.
    pub cause: Option<FaultCause>,
}

impl BoardFault {
    /// Returns what to do next, in words for people.
    pub fn advice(&self) -> &'static str {
        self.cause.map_or_else(|| after_fault(self.fault), |cause| cause.advice())
    }
}

impl From<Fault> for BoardFault {
    fn from(fault: Fault) -> Self {
        Self { fault, cause: None }
    }
}

impl fmt::Display for BoardFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.fault)?;
        self.cause.map_or(Ok(()), |cause| write!(f, " ({cause})"))
    }
}

/// Cause of [`Fault::HostSilent`] or [`Fault::PositionLost`], counted over one and a half
/// times the deadline that has passed. Its text is for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultCause {
    /// Frames were damaged on their way to the board.
    DamagedFrames {
        /// Damaged frames, by the board's last count before its stop.
        damaged: u32,
        /// Frames that were sent.
        sent: u32,
    },
    /// This program woke late: it sent nothing in the meantime.
    LateHost {
        /// Number of late wake-ups.
        times: u32,
        /// Longest time without a message to the board.
        longest: Duration,
    },
    /// Positions were too old when they came to the board.
    OldPositions {
        /// Positions that the board refused for their age.
        old: u32,
        /// Greatest age with which a position was sent.
        oldest: Duration,
    },
}

impl FaultCause {
    /// Returns what to do next, in words for people.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::DamagedFrames { .. } => {
                "Check the baud rate, the cable and the ground between computer and board, and \
                 keep the motors' wires away from them. Then clear the fault."
            }
            Self::LateHost { .. } => {
                "Check what else uses the computer's processor or disk, and whether it sleeps. \
                 Then clear the fault."
            }
            Self::OldPositions { .. } => {
                "Check what else uses the computer's processor, or choose smaller or fewer \
                 pictures; the camera's latency may be wrong, too. Then clear the fault."
            }
        }
    }
}

impl fmt::Display for FaultCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DamagedFrames { damaged, sent } => {
                write!(
                    f,
                    "at least {damaged} of {sent} frames to the board were damaged on the wire"
                )
            }
            Self::LateHost { times, longest } => {
                let longest = longest.as_secs_f64();
                write!(f, "this program woke late {times} times, and was silent for {longest:.1} s")
            }
            Self::OldPositions { old, oldest } => {
                let oldest = oldest.as_secs_f64();
                write!(f, "{old} positions were too old: up to {oldest:.1} s")
            }
        }
    }
}
