//! `plumb-lab control`: compares control laws with each other and with baselines on random rigs
//! in virtual time.
//!
//! The board's laws run on the board's own code: encoded frames in, step counts out, in the chip's
//! arithmetic. Baselines compute in `f64`.

mod baselines;
mod board_controller;
mod bounce;
mod controller;
mod eye;
mod float;
mod following;
mod kinematic;
mod law_controller;
mod oracle;
mod paper;
mod picture;
mod plan_controller;
mod report;
mod simulate;
mod slack_free;
mod suite;
mod tape;
mod turned_frame;

use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc;
use std::thread;

use nalgebra::Point3;
use plumb_emulator::plant::Task;
use plumb_frame::source::BoxedError;
use plumb_protocol::MOTORS;
use plumb_protocol::message::ConfigField;
use plumb_runtime::rig::OutOfRange;
use plumb_sim::limits::RigLimits;
use thiserror::Error;

use picture::Jogged;
use simulate::{Leg, Outcome, View};
use turned_frame::TurnedFrame;

pub use crate::run_id::RunId;
pub use controller::ControllerKind;
pub use eye::{Defect, Stand};
pub use following::{Loss, PathReport, PathSuite, Quantiles, follow_paths};
pub use paper::{PAPER_GAMMAS, PaperSuite, paper};
pub use report::{JogReport, Report};
pub use simulate::RunEnd;
pub use suite::{ASSUMED_LATENCY_FRAMES, Clock, Physics, RigChange, Rigs, Suite, SuiteName};
pub use tape::TapeMeasure;

/// Reason that a benchmark gave no result.
#[derive(Debug, Error)]
pub enum BenchError {
    /// A parameter outside the range of the protocol.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// A configuration that a board refuses.
    #[error("a board would refuse this configuration: {0} is out of range")]
    Config(ConfigField),
    /// A target outside the range of the protocol.
    #[error("a board takes targets within 4 m, not {0}")]
    Target(Point3<f64>),
    /// A controller that a suite cannot use.
    #[error("{controller} {why}")]
    Unsuitable {
        /// Name of the controller.
        controller: String,
        /// What it cannot do, and what to do instead.
        why: &'static str,
    },
    /// A rig that cannot be simulated, or has no valid path.
    #[error("rig {rig} of seed {seed} cannot be simulated", rig = .id.rig, seed = .id.seed)]
    Rig {
        /// Number and seed of the rig.
        id: RunId,
        /// Invalid parameter or path.
        #[source]
        error: BoxedError,
    },
}

impl BenchError {
    /// Returns what makes the error of a rig out of its cause.
    fn of_rig<E: Into<BoxedError>>(id: RunId) -> impl Fn(E) -> Self + Copy {
        move |error| Self::Rig { id, error: error.into() }
    }
}

/// Runs `controller` on the numbered rigs of a suite, on all cores. Calls `progress` with the
/// number of runs done after each run. Returns a report for each target of the suite.
///
/// # Errors
/// If a board refuses the parameters of the law, or a rig is invalid, or the controller is one
/// that cannot drive the rigs of the suite to all targets.
pub fn run(
    controller: &ControllerKind,
    suite: &Suite,
    rigs: Range<u64>,
    seed: u64,
    progress: &mut dyn FnMut(u64),
) -> Result<Vec<Report>, BenchError> {
    check_suitable(controller, suite)?;
    let run_one = |rig| run_one(controller, suite, RunId { seed, rig });
    let runs = in_parallel(rigs.clone(), run_one, progress)?;
    let first = RunId { seed, rig: rigs.start };
    let report = |target: usize| {
        let runs: Vec<_> = runs.iter().filter_map(|run| run.get(target).cloned()).collect();
        Report::new((controller.to_string(), target + 1), suite.name, first, &runs)
    };
    Ok((0..suite.targets).map(report).collect())
}

/// Checks that the controller can drive the rigs of the suite to all targets.
fn check_suitable(controller: &ControllerKind, suite: &Suite) -> Result<(), BenchError> {
    let refusals = [
        (
            suite.targets > 1 && !controller.can_go_on(),
            "drives to one target only: leave it out, or ask for one target",
        ),
        (
            suite.new_runs.is_some() && !controller.can_begin_again(),
            "keeps nothing for a next run: choose a law of the board",
        ),
        (
            !controller.can_drive(suite.motors()),
            "drives rigs with three motors only: choose a law of the board",
        ),
        (
            suite.targets > 1 && suite.motors() < MOTORS,
            "has one target only on rigs with two motors: ask for one target",
        ),
        (
            suite.stand.is_some() && !controller.can_begin_again(),
            "drives to no place in a picture: choose a law of the board",
        ),
    ];
    match refusals.into_iter().find(|(is_unsuitable, _)| *is_unsuitable) {
        Some((_, why)) => Err(BenchError::Unsuitable { controller: controller.to_string(), why }),
        None => Ok(()),
    }
}

/// Runs the numbered rigs on all cores. Calls `progress` with the number of rigs done after each
/// rig. Returns the results in the order of the rigs.
///
/// # Errors
/// The first error of `run_rig`; no further rig is then begun.
fn in_parallel<T: Send>(
    rigs: Range<u64>,
    run_rig: impl Fn(u64) -> Result<T, BenchError> + Sync,
    progress: &mut dyn FnMut(u64),
) -> Result<Vec<T>, BenchError> {
    let next = AtomicU64::new(rigs.start);
    let workers = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let (sender, receiver) = mpsc::channel();
    let end = rigs.end;
    let mut runs: Vec<Option<T>> = rigs.clone().map(|_| None).collect();
    thread::scope(|scope| {
        for _ in 0..workers {
            let (sender, next, run_rig) = (sender.clone(), &next, &run_rig);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= end || sender.send((index, run_rig(index))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        // The receiver ends with this function, so that workers stop after an error.
        for (done, (index, result)) in (1..).zip(receiver) {
            runs[(index - rigs.start) as usize] = Some(result?);
            progress(done);
        }
        Ok::<(), BenchError>(())
    })?;
    Ok(runs.into_iter().flatten().collect())
}

/// Runs one rig. Returns the outcome of each target and the oracle's time for it, seconds.
fn run_one(
    controller: &ControllerKind,
    suite: &Suite,
    id: RunId,
) -> Result<Vec<(Outcome, f64)>, BenchError> {
    let on_error = BenchError::of_rig(id);
    let task = suite.task(id).map_err(on_error)?;
    if let Some(stand) = suite.stand {
        return run_in_picture(controller, suite, (stand, task), id);
    }
    let (mut legs, mut way) = (Vec::new(), task);
    for (number, target) in suite.places(&task, id).into_iter().enumerate() {
        let changed = match number {
            1 => suite.changed(&task.geometry, id).map_err(on_error)?,
            _ => None,
        };
        way = Task { geometry: changed.unwrap_or(way.geometry), target, ..way };
        let oracle_s = oracle::time_s(&way, &RigLimits::default(), suite.threshold_m);
        legs.push(Leg { target, oracle_s: oracle_s.map_err(on_error)?, changed });
        way.start = target;
    }
    let mut controller = controller.build(suite, &task, id)?;
    let view = suite.turned_rad.map(|angle| View::Turned(TurnedFrame::new(angle, &task, id)));
    let outcomes = simulate::run(&mut *controller, suite, &task, id, (&legs, view))?;
    Ok(outcomes.into_iter().zip(legs.iter().map(|leg| leg.oracle_s)).collect())
}

/// Runs one rig in the picture of a camera, after two jogs, as [`run_one`].
fn run_in_picture(
    controller: &ControllerKind,
    suite: &Suite,
    (stand, task): (Stand, Task),
    id: RunId,
) -> Result<Vec<(Outcome, f64)>, BenchError> {
    let on_error = BenchError::of_rig(id);
    let jogged = picture::jog(suite, stand, task, id).map_err(on_error)?;
    let Some(jogged) = jogged else {
        return Ok(vec![(Outcome { end: RunEnd::NoFrame, ..Outcome::default() }, f64::NAN)]);
    };
    let oracle_s = oracle::time_s(&jogged.task, &RigLimits::default(), jogged.threshold_m());
    let oracle_s = oracle_s.map_err(on_error)?;
    let Jogged { measured, view, task, suite } = jogged;
    let mut controller = controller.clone();
    if let Some(law) = controller.settings_mut() {
        law.set_delay(measured.latency_s);
    }
    let target = view.measured(0.0, task.target);
    let leg = Leg { target, oracle_s, changed: None };
    let mut controller = controller.build(&suite, &Task { target, ..task }, id)?;
    let view = Some(View::Picture(view));
    let outcomes = simulate::run(&mut *controller, &suite, &task, id, (&[leg], view))?;
    // Millimetres of the report are pixels.
    let scale = picture::ARRIVED_PX * 1e-3 / suite.threshold_m;
    let in_pixels = |mut outcome: Outcome| {
        outcome.hold_m.iter_mut().for_each(|distance| *distance *= scale as f32);
        (outcome, oracle_s)
    };
    Ok(outcomes.into_iter().map(in_pixels).collect())
}

/// Jogs the motors of the numbered rigs of a suite of pictures, on all cores. Calls `progress` with
/// the number of rigs done after each rig.
///
/// # Errors
/// If a rig is invalid.
pub fn jogs(
    suite: &Suite,
    rigs: Range<u64>,
    seed: u64,
    progress: &mut dyn FnMut(u64),
) -> Result<JogReport, BenchError> {
    let stand = suite.stand.unwrap_or(Stand::InFront);
    let jog = |rig| {
        let id = RunId { seed, rig };
        let on_error = BenchError::of_rig(id);
        let task = suite.task(id).map_err(on_error)?;
        let jogged = picture::jog(suite, stand, task, id).map_err(on_error)?;
        Ok(jogged.map(|jogged| jogged.quality()))
    };
    Ok(JogReport::of(&in_parallel(rigs, jog, progress)?))
}

#[cfg(test)]
mod tests;
