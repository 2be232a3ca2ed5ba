//! Causes that a run reports to its user.

use std::error::Error;
use std::fmt;

use plumb_frame::source::SourceError;
use plumb_protocol::message::{Fault, State};
use plumb_runtime::link::LinkError;
use plumb_runtime::run::{ControlLoopError, RepeatedPicture, RunError, StopReason, Summary};

/// Reason of the end of a run, as its user reads it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The board stopped by itself.
    Board(Fault),
    /// Nothing comes from the board.
    NoTelemetry,
    /// The board acknowledges no position.
    Lagging,
    /// The board restarted.
    Restarted,
    /// The board has lost the session, and the host could not find out why.
    SessionLost,
    /// A program of another version greeted the board.
    OtherProgram,
    /// Another program configured the board.
    Reconfigured,
    /// The board answers no request.
    NoAnswer,
    /// The port is gone.
    Unplugged,
    /// The board refused a request.
    Refused,
    /// The camera delivers nothing more.
    Camera,
    /// The camera repeats one picture.
    RepeatedPicture,
    /// An output of the run cannot go on.
    Output,
    /// A target was not reached in time.
    Timeout,
    /// The measured positions cannot be believed.
    Doubt,
    /// Any other end.
    Other,
}

/// A motor would have passed its travel; whichever it is.
pub const TRAVEL: Cause = Cause::Board(Fault::Travel(0));

impl Cause {
    /// Returns whether two causes are the same, whichever motor's travel they name.
    pub fn is_like(self, other: Self) -> bool {
        match (self, other) {
            (Self::Board(Fault::Travel(_)), Self::Board(Fault::Travel(_))) => true,
            _ => self == other,
        }
    }

    /// Returns the cause that ended a run; `None` for a run that ended as intended.
    pub fn of(result: &Result<Summary, RunError>) -> Option<Self> {
        match result {
            Ok(summary) => Self::of_reason(&summary.ending),
            Err(RunError::Connect(error)) => Some(Self::of_link(error)),
            Err(RunError::Broken { error, summary }) => Some(match (&summary.ending, error) {
                (_, ControlLoopError::Repeated(_)) => Self::RepeatedPicture,
                (StopReason::Fault(fault), _) => Self::Board(fault.fault),
                (_, ControlLoopError::Link(error)) => Self::of_link(error),
                (_, ControlLoopError::Source(error)) if is_repetition(error) => {
                    Self::RepeatedPicture
                }
                (_, ControlLoopError::Source(_)) => Self::Camera,
                (_, ControlLoopError::Observer(_)) => Self::Output,
                _ => Self::Other,
            }),
            Err(_) => Some(Self::Other),
        }
    }

    fn of_reason(reason: &StopReason) -> Option<Self> {
        match reason {
            StopReason::Fault(fault) => Some(Self::Board(fault.fault)),
            StopReason::Timeout | StopReason::TargetsSilent => Some(Self::Timeout),
            StopReason::Doubt(_) => Some(Self::Doubt),
            StopReason::Reached | StopReason::AlreadyThere | StopReason::Interrupted => None,
            _ => Some(Self::Other),
        }
    }

    /// Returns the cause of an error of the link.
    pub fn of_link(error: &LinkError) -> Self {
        match error {
            LinkError::Fault(fault) | LinkError::Faulted { fault, .. } => Self::Board(*fault),
            LinkError::NoTelemetry { .. } => Self::NoTelemetry,
            LinkError::Lagging { .. } => Self::Lagging,
            LinkError::Restarted { .. } => Self::Restarted,
            LinkError::SessionLost { .. } => Self::SessionLost,
            LinkError::OtherProgram { .. } => Self::OtherProgram,
            LinkError::Reconfigured { .. } => Self::Reconfigured,
            LinkError::Silent { .. } => Self::NoAnswer,
            LinkError::Lost { .. } => Self::Unplugged,
            LinkError::Refused { .. } => Self::Refused,
            _ => Self::Other,
        }
    }
}

/// Returns whether the message of a camera's error says that it repeats one picture.
fn is_repetition(error: &SourceError) -> bool {
    error.source().is_some_and(|cause| cause.is::<RepeatedPicture>())
}

/// The name of the fault without its motor, or a few words.
impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Board(Fault::Travel(_)) => "Travel",
            Self::Board(Fault::Driver(fault)) => {
                let name = format!("{fault:?}");
                return write!(f, "Driver {}", name.split('(').next().unwrap_or_default());
            }
            Self::Board(fault) => return write!(f, "{fault:?}"),
            Self::NoTelemetry => "nothing from the board",
            Self::Lagging => "positions not acknowledged",
            Self::Restarted => "board restarted",
            Self::SessionLost => "session lost",
            Self::OtherProgram => "another version's greeting",
            Self::Reconfigured => "another configuration",
            Self::NoAnswer => "no answer",
            Self::Unplugged => "unplugged",
            Self::Refused => "refused",
            Self::Camera => "camera gone",
            Self::RepeatedPicture => "one picture repeated",
            Self::Output => "output failed",
            Self::Timeout => "not reached in time",
            Self::Doubt => "positions in doubt",
            Self::Other => "other",
        })
    }
}

/// Returns the fault of a board in this state.
pub fn fault_of(state: State) -> Option<Fault> {
    match state {
        State::Fault(fault) => Some(fault),
        _ => None,
    }
}
