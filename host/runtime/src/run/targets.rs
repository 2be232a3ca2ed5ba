//! Targets that move: what comes from their source, the messages to the board, and how well the
//! ball follows.

mod drive;
mod summary;

pub use drive::TargetUse;
pub(super) use drive::{REST_M, TargetDrive, TargetRules};
pub use summary::TargetsSummary;
