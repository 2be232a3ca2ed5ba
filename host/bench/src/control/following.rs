//! The suites in which the ball follows a path.
//!
//! Each rig has four shapes, each at four speeds; in a picture of two cables it has a circle at two
//! speeds. The ball rests at the path's begin; a run takes 12 s and is measured from 3 s on.

mod board_follower;
mod build;
mod course;
mod deviation;
mod follower;
mod in_picture;
mod law_follower;
mod report;
mod simulate;

use std::ops::Range;

use plumb_emulator::plant::Task;
use plumb_path::shape::{Shape, ShapeKind};

use super::controller::ControllerKind;
use super::suite::{Suite, SuiteName};
use super::{BenchError, in_parallel};
use crate::run_id::RunId;
use course::{Course, SHAPES, SPEEDS_M_S, place};
use report::Run;
use simulate::Outcome;

pub use report::{PathReport, Quantiles};
pub use simulate::Loss;

named! {
    /// Suite in which the ball follows paths.
    PathSuite:
    Rigid "path" "circle, square, eight and spline on rigid cables";
    Elastic "path-elastic" "circle, square, eight and spline on 800 and 150 N/m in turn";
    Picture "path-picture" "a circle of 15 cm in the picture of two cables, after two jogs";
}

impl PathSuite {
    /// Returns the rigs, the camera and the physics.
    fn conditions(self) -> Suite {
        Suite::new(match self {
            Self::Rigid => SuiteName::QuasiStatic,
            Self::Elastic => SuiteName::Elastic,
            Self::Picture => SuiteName::Picture,
        })
    }

    /// Returns the speeds along the paths, m/s.
    const fn speeds_m_s(self) -> &'static [f64] {
        match self {
            Self::Rigid | Self::Elastic => &SPEEDS_M_S,
            Self::Picture => &in_picture::SPEEDS_M_S,
        }
    }
}

/// Returns the name of a shape.
const fn name(kind: ShapeKind) -> &'static str {
    match kind {
        ShapeKind::Circle => "circle",
        ShapeKind::Line => "line",
        ShapeKind::Eight => "eight",
        ShapeKind::Square => "square",
        ShapeKind::Spline => "spline",
    }
}

/// Runs `controller` along the paths of the numbered rigs, on all cores. Calls `progress` with the
/// number of rigs done after each rig. Returns a report for each speed.
///
/// # Errors
/// If `controller` cannot follow, a board refuses the parameters of the law, or a rig is invalid.
pub fn follow_paths(
    controller: &ControllerKind,
    suite: PathSuite,
    rigs: Range<u64>,
    seed: u64,
    progress: &mut dyn FnMut(u64),
) -> Result<Vec<PathReport>, BenchError> {
    let conditions = suite.conditions();
    let run_rig = |rig| match suite {
        PathSuite::Picture => in_picture::run_rig(controller, &conditions, RunId { seed, rig }),
        PathSuite::Rigid | PathSuite::Elastic => {
            run_rig(controller, &conditions, RunId { seed, rig })
        }
    };
    let runs = in_parallel(rigs.clone(), run_rig, progress)?;
    let first = RunId { seed, rig: rigs.start };
    let report = |(k, &speed_m_s): (usize, &f64)| {
        let mut at_speed = Vec::new();
        for (rig, outcomes) in rigs.clone().zip(&runs) {
            let run = |(kind, outcome): (ShapeKind, &Outcome)| Run {
                rig,
                shape: name(kind),
                outcome: *outcome,
            };
            at_speed.extend(SHAPES.into_iter().zip(&outcomes[k]).map(run));
        }
        let rigs = (first, runs.len() as u64);
        PathReport::new(controller.to_string(), suite, speed_m_s, rigs, &at_speed)
    };
    Ok(suite.speeds_m_s().iter().enumerate().map(report).collect())
}

/// Runs the paths of one rig. Returns, for each speed, the outcome of each shape.
fn run_rig(
    controller: &ControllerKind,
    conditions: &Suite,
    id: RunId,
) -> Result<Vec<Vec<Outcome>>, BenchError> {
    let task = conditions.task(id).map_err(BenchError::of_rig(id))?;
    let on_error = BenchError::of_rig(id);
    let mut shapes = Vec::new();
    for kind in SHAPES {
        let shape = place(kind, &task, id).map_err(on_error)?;
        shapes.push(shape.ok_or("it has no room for a path").map_err(BenchError::of_rig(id))?);
    }
    let mut number = 0;
    let mut run = |shape: &Shape, speed_m_s| {
        number += 1;
        let course = Course::new(shape, speed_m_s).map_err(on_error)?;
        run_course(controller, conditions, &course, &task, (id, number))
    };
    let at_speed = |speed_m_s| shapes.iter().map(|shape| run(shape, speed_m_s)).collect();
    SPEEDS_M_S.into_iter().map(at_speed).collect()
}

/// Runs the path number `number` of a rig.
fn run_course(
    controller: &ControllerKind,
    conditions: &Suite,
    course: &Course,
    task: &Task,
    (id, number): (RunId, u64),
) -> Result<Outcome, BenchError> {
    let start = course.start();
    let task = Task { start, target: start, ..*task };
    let mut follower = build::follower(controller, conditions, course, &task, id)?;
    simulate::run(&mut *follower, course, (conditions, None), &task, (id, number))
}

#[cfg(test)]
mod tests;
