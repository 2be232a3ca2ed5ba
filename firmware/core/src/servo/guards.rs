//! The guards of a drive, together.

use plumb_protocol::message::Fault;
use plumb_protocol::units::{Micros, Point};

use super::divergence::DivergenceGuard;
use super::following::FollowingGuard;
use super::magnitude;
use super::nearest::Nearest;
use super::progress::ProgressGuard;
use crate::params::Params;
use crate::plan::RunOut;

/// Guards that compare the ball's way with its target and with the motors. They outlive a change of
/// the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Guards {
    divergence: DivergenceGuard,
    following: FollowingGuard,
    progress: ProgressGuard,
}

/// State of a drive after a position.
#[derive(Debug, Clone, Copy)]
pub struct DriveState {
    /// When the frame of the position was captured.
    pub captured: Micros,
    /// Filtered position of the ball, µm.
    pub ball: [i32; 3],
    /// The target.
    pub target: Point,
    /// Distance between the two, µm.
    pub error: u32,
    /// The motors.
    pub motors: MotorsOfDrive,
}

/// Motor positions of a drive after a position, Q4 steps.
#[derive(Debug, Clone, Copy)]
pub struct MotorsOfDrive {
    /// Present ones.
    pub present: [i32; 3],
    /// Those when the frame of the position was captured.
    pub at_capture: [i32; 3],
}

impl DriveState {
    /// Creates the state with its error.
    pub fn new(captured: Micros, ball: [i32; 3], target: Point, motors: MotorsOfDrive) -> Self {
        Self { captured, ball, target, error: magnitude(super::error(ball, target)), motors }
    }
}

impl Guards {
    /// Begins anew, for the next drive.
    pub(super) fn reset(&mut self) {
        self.divergence.reset();
        self.following = FollowingGuard::default();
        self.progress = ProgressGuard::default();
    }

    /// Returns the target of the last position; `None` before the first one.
    pub(super) fn last_target(&self) -> Option<Point> {
        self.divergence.last_target()
    }

    /// Notes at `now` that the target is replaced to which the ball had `way` to go (µm), while the
    /// motors come to rest by `run_out` without a new setpoint.
    pub fn note_change(&mut self, now: Micros, way: [i32; 3], run_out: &RunOut) {
        self.divergence.note_change(now, way, run_out);
    }

    /// Takes in the state after a position. Returns the fault that stops the drive; call once for
    /// each position.
    pub fn update(&mut self, now: Micros, state: &DriveState, params: &Params) -> Option<Fault> {
        let DriveState { ball, target, error, motors, .. } = *state;
        let here = Nearest { position: ball, target, error };
        let radius = params.reached.radius.0.unsigned_abs();
        let diverged = self.divergence.update(now, state, &params.growth);
        let left_behind = self.following.update(ball, motors.present, &params.following);
        let stuck = self.progress.update(now, here, radius, &params.progress);
        match (diverged, left_behind, stuck) {
            (true, ..) => Some(Fault::ErrorGrowing),
            (_, true, _) => Some(Fault::NotFollowing),
            (.., true) => Some(Fault::NoProgress),
            _ => None,
        }
    }
}
