//! The follower of a controller, by its kind.

use plumb_emulator::plant::Task;

use super::super::BenchError;
use super::super::controller::{self, ControllerKind};
use super::super::suite::Suite;
use super::board_follower::BoardFollower;
use super::course::Course;
use super::follower::CourseFollower;
use super::law_follower::LawFollower;
use crate::run_id::RunId;

/// Creates the follower of a run. The ball of `task` rests at the path's begin.
pub(super) fn follower<'a>(
    kind: &ControllerKind,
    conditions: &Suite,
    course: &'a Course,
    task: &Task,
    id: RunId,
) -> Result<Box<dyn CourseFollower + 'a>, BenchError> {
    Ok(match kind {
        ControllerKind::Board(law) => {
            let (config, _) = controller::checked(law, conditions)?;
            Box::new(BoardFollower::new(config, conditions.prior, course))
        }
        ControllerKind::Broyden { mean } => {
            Box::new(LawFollower::new(controller::broyden(*mean, conditions, task)?, course))
        }
        ControllerKind::Model { percent, mean } => {
            let model = controller::model((*percent, *mean), conditions, task, id)?;
            Box::new(LawFollower::new(model, course))
        }
        ControllerKind::Oracle | ControllerKind::Reference => {
            let why = "cannot follow a path: choose another controller";
            return Err(BenchError::Unsuitable { controller: kind.to_string(), why });
        }
    })
}
