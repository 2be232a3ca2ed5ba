//! Actions of the services.

use plumb_runtime::operator::OperatorCommand;

/// Action of a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Action {
    /// Ramps the motors down. Nothing moves the ball from then on.
    Stop,
    /// Ends the Stop whose number was published.
    Resume,
    /// Holds the ball.
    Hold,
    /// Clears the fault of a board.
    ClearFault,
}

impl Action {
    /// All actions. The index of an action is that of its service.
    pub(crate) const ALL: [Self; 4] = [Self::Stop, Self::Resume, Self::Hold, Self::ClearFault];

    /// Returns the name of the service in its namespace.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Stop => "stop",
            Self::Resume => "resume",
            Self::Hold => "hold",
            Self::ClearFault => "clear_fault",
        }
    }

    /// Returns the command for the control loop; `None` for a Resume, which is carried out at once.
    pub(crate) fn command(self) -> Option<OperatorCommand> {
        match self {
            Self::Stop => Some(OperatorCommand::Stop),
            Self::Resume => None,
            Self::Hold => Some(OperatorCommand::Hold),
            Self::ClearFault => Some(OperatorCommand::ClearFault),
        }
    }
}
