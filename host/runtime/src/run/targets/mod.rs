//! Targets that move: what comes from their source, the messages to the board, and how well the
//! ball follows.

mod drive;
mod follow;
mod summary;

pub use drive::TargetUse;
pub(super) use drive::{TargetDrive, TargetRules};
pub use summary::TargetsSummary;
