//! Commissioning: jogs each motor a little, watches the ball, and names what is wrong with the
//! wiring, the cables or the camera's pose.
//!
//! Paying out one cable moves the ball in a direction that follows from the place of its motor
//! only: away from the line between the other two motors, and down. These are the signs Σ of
//! dp/du. [`Examination::run`] measures the three directions and looks for the smallest number of
//! faults that explains them ([`Report::of`]). It needs no model of the rig; the rough size in the
//! rig file makes it more exact.
//!
//! The board receives jogs only, no positions and no targets: the pose may be wrong.

mod correction;
mod error;
mod examination;
mod explanation;
mod fault;
mod fit;
mod look;
mod pictures;
mod report;
mod response;
mod sectors;
#[cfg(test)]
mod tests;

pub use correction::corrected;
pub use error::ExaminationError;
pub use examination::{Examination, ExaminationParts};
pub use explanation::{Explanation, Frame, Wiring};
pub use fault::{Fault, Output};
pub use report::Report;
pub use response::{Motion, Probe, Response};
pub use sectors::{Sector, Sectors};
