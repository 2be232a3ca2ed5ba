//! A path that the ball follows: its check, the messages to the board, and how well the ball
//! follows.

mod clock;
mod deviation;
mod drive;
mod plan;

pub(super) use deviation::Deviations;
pub use deviation::{PathSummary, Spread, Spreads};
pub(super) use drive::{LEAST_PERIOD_S, PathDrive};
pub use plan::{PathPlan, PathPlanError};
