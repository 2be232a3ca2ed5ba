//! Commands of an operator, and their outcomes.

use std::fmt;

use nalgebra::Point3;
use plumb_protocol::message::{Command, Jog, Refusal};
use plumb_protocol::units::{Rate, Steps16};
use thiserror::Error;

use crate::rig::{MotionError, MotionRules, Outside};

/// Command of an operator.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum OperatorCommand {
    /// Drives the ball to this target, metres in the rig frame.
    Target(Point3<f64>),
    /// Holds the ball. A ball in motion comes to rest first, and is held where it then is.
    Hold,
    /// Ramps the motors down, and holds the rig: commands that move the ball are refused before a
    /// Resume. Replaces the commands that wait.
    Stop,
    /// Ends a Stop, at once. The ball stays where it is.
    Resume {
        /// Number of the Stop, from [`OperatorSender::stop`](super::OperatorSender::stop).
        stop: u64,
    },
    /// Ramps the motors down as a Stop does, and does not hold the rig: for a ramp of the host
    /// itself. Replaces the commands that wait. It is refused, and is not needed, while a Stop
    /// holds.
    RampDown,
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
    #[error("the target is outside the workspace of the rig file: {0}")]
    TargetOutside(Outside),
    /// The target is outside the triangle of the motors. The board has not received it.
    #[error("the target is outside the triangle of the motors, where a cable is slack")]
    TargetSlack,
    /// The target is too near to the border of the picture or to the motors. The board has not
    /// received it.
    #[error("pixel {0:?} is too near to the border of the picture or to the motors")]
    TargetBeside([f64; 2]),
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
                let [x, y, z] = [target.x, target.y, target.z].map(|metres| Short(metres, 3));
                write!(f, "go to ({x}, {y}, {z}) m")
            }
            Self::Hold => f.write_str("hold"),
            Self::Stop => f.write_str("stop"),
            Self::Resume { stop } => write!(f, "resume after the Stop of command {stop}"),
            Self::RampDown => f.write_str("ramp down"),
            Self::ClearFault => f.write_str("clear the fault"),
            Self::Jog { motor, distance, .. } => {
                let letter = char::from(b'A'.saturating_add(*motor));
                write!(f, "jog {letter} by {:+} steps", Short(*distance, 0))
            }
            Self::End => f.write_str("end the run"),
        }
    }
}

/// Number with this many digits after the point, however large it is.
struct Short(f64, usize);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value, digits) = *self;
        match (value.abs() < 1e6, f.sign_plus()) {
            (true, true) => write!(f, "{value:+.digits$}"),
            (true, false) => write!(f, "{value:.digits$}"),
            (false, true) => write!(f, "{value:+e}"),
            (false, false) => write!(f, "{value:e}"),
        }
    }
}

impl OperatorCommand {
    /// Returns whether the command replaces those that wait.
    pub(crate) fn is_urgent(self) -> bool {
        matches!(self, Self::Stop | Self::RampDown | Self::End)
    }

    /// Returns whether the command moves the ball or has the board act on the motors. Such a
    /// command is refused while a Stop is in force.
    pub(crate) fn moves_the_ball(self) -> bool {
        match self {
            Self::Target(_) | Self::Hold | Self::Jog { .. } => true,
            Self::Stop | Self::Resume { .. } | Self::RampDown | Self::ClearFault | Self::End => {
                false
            }
        }
    }

    /// Returns the command for the board; `None` for [`Self::End`], which is of the host alone, as
    /// is [`Self::Resume`], which never waits.
    ///
    /// # Errors
    /// Where a target is not one by `rules`, or a jog is out of range.
    pub(crate) fn on_wire(self, rules: &MotionRules) -> Result<Option<Command>, CommandRefusal> {
        Ok(Some(match self {
            Self::Target(target) => {
                let target = rules.target(target.into());
                Command::Target(target.map_err(|error| match error {
                    MotionError::Workspace(outside) => CommandRefusal::TargetOutside(outside),
                    MotionError::Picture { pixel } => CommandRefusal::TargetBeside(pixel),
                    _ => CommandRefusal::TargetSlack,
                })?)
            }
            Self::Hold => Command::Hold,
            Self::Stop | Self::RampDown => Command::Stop,
            Self::ClearFault => Command::ClearFault,
            Self::Jog { motor, distance, rate } => {
                let distance = Steps16::from_si(distance).ok_or(CommandRefusal::OutOfRange)?;
                let rate = Rate::from_si(rate).ok_or(CommandRefusal::OutOfRange)?;
                Command::Jog(Jog { motor, distance, rate })
            }
            Self::End | Self::Resume { .. } => return Ok(None),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_out_of_range_is_named_in_few_characters() {
        let jog = |distance| OperatorCommand::Jog { motor: 1, distance, rate: 40.0 }.to_string();
        assert_eq!([jog(20.0), jog(-160.0)], ["jog B by +20 steps", "jog B by -160 steps"]);
        assert_eq!(jog(1e300), "jog B by +1e300 steps");
        let target = |x| OperatorCommand::Target(Point3::new(x, -0.1, 0.15)).to_string();
        assert_eq!(target(0.4), "go to (0.400, -0.100, 0.150) m");
        assert_eq!(target(-1e300), "go to (-1e300, -0.100, 0.150) m");
    }
}
