//! The guards of a drive, together.

use plumb_protocol::message::Fault;
use plumb_protocol::units::{Micros, Point};

use super::divergence::DivergenceGuard;
use super::following::FollowingGuard;
use super::magnitude;
use super::nearest::Nearest;
use super::progress::ProgressGuard;
use crate::params::Params;

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
    /// Filtered position of the ball, µm.
    pub ball: [i32; 3],
    /// The target.
    pub target: Point,
    /// Distance between the two, µm.
    pub error: u32,
    /// Motor positions, Q4 steps.
    pub motors: [i32; 3],
}

impl DriveState {
    /// Creates the state with its error.
    pub fn new(ball: [i32; 3], target: Point, motors: [i32; 3]) -> Self {
        Self { ball, target, error: magnitude(super::error(ball, target)), motors }
    }
}

impl Guards {
    /// Takes in the state after a position. Returns the fault that stops the drive; call once for
    /// each position.
    pub fn update(&mut self, now: Micros, state: &DriveState, params: &Params) -> Option<Fault> {
        let DriveState { ball, target, error, motors } = *state;
        let here = Nearest { position: ball, target, error };
        let radius = params.reached.radius.0.unsigned_abs();
        let diverged = self.divergence.update(now, here, &params.growth);
        let left_behind = self.following.update(ball, motors, &params.following);
        let stuck = self.progress.update(now, here, radius, &params.progress);
        match (diverged, left_behind, stuck) {
            (true, ..) => Some(Fault::ErrorGrowing),
            (_, true, _) => Some(Fault::NotFollowing),
            (.., true) => Some(Fault::NoProgress),
            _ => None,
        }
    }
}
