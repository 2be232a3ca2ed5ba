//! Commands of an operator, and their outcomes.

use std::fmt;

use nalgebra::Point3;
use plumb_protocol::config::Workspace;
use plumb_protocol::message::{Command, Jog, Refusal};
use plumb_protocol::units::{Point, Rate, Steps16};
use thiserror::Error;

/// Command of an operator.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum OperatorCommand {
    /// Drives the ball to this target, metres in the rig frame.
    Target(Point3<f64>),
    /// Holds the ball. A ball in motion comes to rest first, and is held where it then is.
    Hold,
    /// Ramps the motors down. Replaces the commands that wait.
    Stop,
    /// Clears the fault of a board whose motors stand.
    ClearFault,
    /// Turns one motor of a board whose motors stand.
    Jog {
        /// Index of the motor: 0 = A, 1 = B, 2 = C.
        motor: u8,
        /// Distance from the present position, full steps; + pays cable out.
        distance: f64,
        /// Highest rate, full steps/s; above 0.
        rate: f64,
    },
    /// Ends the run: the motors ramp down, and the outputs are completed. Replaces the commands
    /// that wait.
    End,
}

/// Outcome of a command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CommandOutcome {
    /// The board carries the command out.
    Accepted,
    /// The command is not carried out.
    Refused(CommandRefusal),
}

/// Reason why a command is not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum CommandRefusal {
    /// The target is outside the workspace of the rig file. The board has not received it.
    #[error("the target is outside the workspace of the rig file")]
    TargetOutside,
    /// The distance or the rate of a jog is not a number, or far out of range.
    #[error("the distance or the rate of the jog is out of range")]
    OutOfRange,
    /// A later Stop or End replaced the command before the board answered it.
    #[error("a later command replaced it")]
    Replaced,
    /// The run ended before the board answered it.
    #[error("the run ended before it")]
    RunEnded,
    /// The board refused it.
    #[error("the board refused it: {0}")]
    Board(Refusal),
}

impl fmt::Display for OperatorCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Target(target) => {
                write!(f, "go to ({:.3}, {:.3}, {:.3}) m", target.x, target.y, target.z)
            }
            Self::Hold => f.write_str("hold"),
            Self::Stop => f.write_str("stop"),
            Self::ClearFault => f.write_str("clear the fault"),
            Self::Jog { motor, distance, .. } => {
                write!(f, "jog {} by {distance:+.0} steps", char::from(b'A'.saturating_add(*motor)))
            }
            Self::End => f.write_str("end the run"),
        }
    }
}

impl OperatorCommand {
    /// Returns whether the command replaces those that wait.
    pub(crate) fn is_urgent(self) -> bool {
        matches!(self, Self::Stop | Self::End)
    }

    /// Returns the command for the board; `None` for [`Self::End`], which is of the host alone.
    ///
    /// # Errors
    /// Where a target is outside `workspace`, or a jog is out of range.
    pub(crate) fn on_wire(self, workspace: &Workspace) -> Result<Option<Command>, CommandRefusal> {
        Ok(Some(match self {
            Self::Target(target) => {
                let target = Point::from_metres(target.into());
                let target = target.filter(|target| workspace.contains(*target));
                Command::Target(target.ok_or(CommandRefusal::TargetOutside)?)
            }
            Self::Hold => Command::Hold,
            Self::Stop => Command::Stop,
            Self::ClearFault => Command::ClearFault,
            Self::Jog { motor, distance, rate } => {
                let distance = Steps16::from_si(distance).ok_or(CommandRefusal::OutOfRange)?;
                let rate = Rate::from_si(rate).ok_or(CommandRefusal::OutOfRange)?;
                Command::Jog(Jog { motor, distance, rate })
            }
            Self::End => return Ok(None),
        }))
    }
}
