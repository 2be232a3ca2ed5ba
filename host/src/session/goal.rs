//! Goal of a run: targets of the rig file, waypoints, a path, targets that move, or the present
//! place of the ball.

use plumb_runtime::link::Transport;
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{PathPlan, Run, RunError, Waypoint};
use plumb_runtime::targets::{TargetOrigin, TargetSender, TargetStream};

use crate::cli::exit::{Failure, failed};

/// Goal of a run.
pub(crate) enum Goal {
    /// The targets of the rig file.
    Targets,
    /// These waypoints; repeated where the flag is set.
    Waypoints(Vec<Waypoint>, bool),
    /// This path.
    Path(Box<PathPlan>),
    /// Targets that move.
    Moving(TargetOrigin),
    /// The place where the ball is, until the run is interrupted.
    PresentPlace,
}

impl Goal {
    /// Returns whether a run with this goal goes on until somebody ends it.
    pub(crate) fn is_endless(&self) -> bool {
        match self {
            Self::PresentPlace | Self::Waypoints(_, true) => true,
            Self::Path(plan) => plan.trajectory().is_loop(),
            Self::Targets | Self::Waypoints(_, false) | Self::Moving(_) => false,
        }
    }

    /// Gives waypoints or a path to `run`; it has the other goals from elsewhere.
    pub(crate) fn set<T: Transport>(&self, run: &mut Run<T>) -> Result<(), RunError> {
        match self {
            Self::Waypoints(waypoints, is_repeated) => run.set_waypoints(waypoints, *is_repeated),
            Self::Path(plan) => run.set_path((**plan).clone()),
            Self::Targets | Self::PresentPlace | Self::Moving(_) => Ok(()),
        }
    }

    /// Starts to read the targets that move, where these are the goal.
    pub(crate) fn stream(
        &self,
        rig: &Rig,
        sender: TargetSender,
    ) -> Result<Option<TargetStream>, Failure> {
        let Self::Moving(origin) = self else { return Ok(None) };
        if let TargetOrigin::Program(address) = origin {
            if rig.camera.stream.as_ref() == Some(address) {
                let why = "`camera.stream` of the rig file is the same; give one of them a socket";
                return Err(failed(format!("targets from {address}: {why}")));
            }
            note!("targets: from {address}");
        }
        Ok(Some(TargetStream::start(origin.clone(), sender)?))
    }

    /// Names the first target that is nearer to the border of the workspace than the ball is held:
    /// the board stops where the ball crosses it.
    pub(crate) fn tell_target_at_border(&self, rig: &Rig) {
        let targets: Vec<[f64; 3]> = match self {
            Self::Targets => rig.target_places().collect(),
            Self::Waypoints(waypoints, _) => waypoints.iter().map(|it| it.target).collect(),
            Self::Path(_) | Self::Moving(_) | Self::PresentPlace => return,
        };
        if let Some(target) = rig.target_at_border(targets) {
            tell!("target {} is {target}", target.number);
        }
    }
}
