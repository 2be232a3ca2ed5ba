//! Commissioning: jogs each motor a little, watches the ball, and names what is wrong with the
//! wiring, the cables or the camera's pose.
//!
//! Paying out one cable moves the ball in a direction that follows from the place of its motor
//! only: down, away from the motor, and towards the line between the other two. These are the
//! signs Σ of dp/du. [`Examination::run`] measures the three directions and looks for the smallest
//! number of faults that explains them ([`Report::of`]). It needs no model of the rig; the rough
//! size in the rig file makes it more exact.
//!
//! The board receives jogs only, no positions and no targets: the pose may be wrong.

mod correction;
mod examination;
mod explanation;
mod fault;
mod report;
mod response;
#[cfg(test)]
mod tests;

use plumb_cameras::camera_file::COMPARE_BALL;
use plumb_runtime::doubt::Doubt;
use thiserror::Error;

use crate::watch::WatchError;

pub use correction::{NoMotors, corrected};
pub use examination::Examination;
pub use explanation::{Explanation, Frame, Sector, Sectors, Wiring};
pub use fault::{Fault, Output};
pub use report::Report;
pub use response::{Motion, Probe, Response};

/// Reason that an examination ended without a result. The motors stand or ramp down.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ExaminationError {
    /// The board, the camera or an output failed, or somebody interrupted.
    #[error(transparent)]
    Watch(#[from] WatchError),
    /// The ball was not seen before a motor turned.
    #[error(
        "the ball is seen in {seen} of {frames} pictures, {with_depth} of them with depth; {}",
        unseen_advice(.doubt.as_ref())
    )]
    BallNotSeen {
        /// Pictures.
        frames: u32,
        /// Pictures with a ball.
        seen: u32,
        /// Pictures with a ball whose position is known.
        with_depth: u32,
        /// Doubt for which what looks like the ball was rejected.
        doubt: Option<Doubt>,
    },
    /// The ball went out of sight while a motor turned.
    #[error(
        "the ball went out of sight after output {output} had turned by {steps:.0} steps; `plumb \
         jog` turns it back; hang the ball in the middle of the picture"
    )]
    BallLost {
        /// Output whose motor turned.
        output: Output,
        /// Steps until then, + pays out.
        steps: f64,
    },
    /// The ball does not hang still.
    #[error(
        "the ball does not hang still: its positions scatter by {scatter_mm:.0} mm; wait until it \
         is at rest, and remove what else has its colour"
    )]
    Unsteady {
        /// Scatter of the measured positions, millimetres.
        scatter_mm: f64,
    },
}

/// Returns what to do about a ball that is not seen.
fn unseen_advice(doubt: Option<&Doubt>) -> String {
    match doubt {
        Some(doubt) => doubt.with_advice(),
        None => format!("hang it into the picture, 0.5 to 2 m from the camera; {COMPARE_BALL}"),
    }
}
