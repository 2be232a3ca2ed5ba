//! A path that the ball follows: its check, the messages to the board, and how well the ball
//! follows.

mod clock;
mod deviation;
mod drive;
mod plan;

pub use deviation::{PathSummary, Spread};
pub(super) use drive::PathDrive;
pub use plan::{PathPlan, PathPlanError};
