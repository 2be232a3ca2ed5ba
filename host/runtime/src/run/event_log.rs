//! Events of a run as events of `tracing`.

use tracing::{debug, info};

use crate::observer::RunEvent;
use crate::operator::CommandOutcome;

/// Emits `event` of a run: at debug level where it is about a single frame, else at info level.
pub(super) fn log_event(event: &RunEvent) {
    match event {
        RunEvent::TargetSet { number, target } => {
            let target = format!("{target:.4}");
            info!(number, %target, "driving to a target");
        }
        RunEvent::TargetEnded { number, reason } => info!(number, %reason, "ended the drive"),
        RunEvent::FrameLost { message } => debug!(%message, "lost a frame"),
        RunEvent::Command { number, command, outcome: CommandOutcome::Accepted } => {
            info!(number, ?command, "carried out a command of the operator");
        }
        RunEvent::Command { number, command, outcome: CommandOutcome::Refused(reason) } => {
            info!(number, ?command, %reason, "refused a command of the operator");
        }
        RunEvent::Targets(event) => info!(%event, "targets that move"),
        RunEvent::Stop(event) => info!(%event, "stop"),
        RunEvent::BoardStopped { fault } => info!(%fault, "the board stopped outside of a drive"),
    }
}
