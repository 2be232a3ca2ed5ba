//! The rule of "reached" on the host.
//!
//! The board holds the ball once its test says that the ball rests at the target. It does not
//! know the tolerance of a waypoint, and its telemetry is about a target that the host may have
//! replaced. So the host asks for telemetry about this target, an error within this waypoint's
//! tolerance, and a picture that shows the ball there. A ball that passes a waypoint with a wide
//! tolerance and no dwell time need not be held.

use nalgebra::Point3;
use plumb_frame::observation::Gaussian3;
use plumb_protocol::message::{State, Telemetry};

/// Largest distance of the measured position from a reached target, in tolerances. The noise of a
/// single frame has room; another target is farther away.
const PLAUSIBLE_TOLERANCES: f64 = 2.0;

/// A target, and how near the ball must come to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival {
    /// The target, metres in the rig frame.
    pub(super) target: Point3<f64>,
    /// Distance within which the target counts as reached, metres.
    pub(super) tolerance: f64,
    /// Whether the ball may pass the target without a stop.
    pub(super) may_pass: bool,
}

impl Arrival {
    /// Returns whether the target is reached: by `telemetry`, which is about this target, the board
    /// holds the ball within the tolerance, and the measured `position` is near the target. Where
    /// the ball may pass, the board may still drive to the target.
    pub(super) fn is_reached(
        &self,
        telemetry: Option<&Telemetry>,
        position: Option<Gaussian3>,
    ) -> bool {
        let Self { target, tolerance, may_pass } = *self;
        let is_held = telemetry.is_some_and(|telemetry| {
            (telemetry.state == State::Holding || may_pass && telemetry.state == State::Seeking)
                && telemetry.filtered_error.to_si() <= tolerance
        });
        let is_near = |position: Gaussian3| {
            (position.mean - target).norm() <= PLAUSIBLE_TOLERANCES * tolerance
        };
        is_held && position.is_some_and(is_near)
    }
}
