//! Failures of a simulated rig.

use plumb_emulator::plant::RigError;
use plumb_frame::source::SourceError;
use plumb_runtime::link::LinkError;
use plumb_runtime::rig::check::SimulationMistake;
use thiserror::Error;

use crate::synthetic::SyntheticError;

/// Reason that a simulated rig gave no frame.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// The rig cannot follow its motors. No further frame comes.
    #[error("the simulated rig cannot follow its motors")]
    Rig(#[from] RigError),
    /// The frame could not be rendered.
    #[error(transparent)]
    Synthetic(#[from] SyntheticError),
}

impl From<SimulationError> for SimulationMistake {
    fn from(error: SimulationError) -> Self {
        let key = match error {
            SimulationError::Rig(RigError::CannotHang { .. }) => "simulation.start",
            SimulationError::Rig(RigError::Flat { .. } | RigError::AboveOneAnother { .. }) => {
                "simulation.motors"
            }
            _ => "simulation",
        };
        Self { key, error: error.into() }
    }
}

impl From<SimulationError> for SourceError {
    fn from(error: SimulationError) -> Self {
        match error {
            SimulationError::Rig(_) => Self::over(error),
            SimulationError::Synthetic(_) => Self::new(error),
        }
    }
}

impl From<SimulationError> for LinkError {
    fn from(error: SimulationError) -> Self {
        Self::Other(error.into())
    }
}
