//! `plumb bench control`: laws against each other and against what is possible, on random rigs, in
//! virtual time.
//!
//! Our laws run as the board runs them: frames in, step counts out, in the chip's arithmetic. What
//! they are compared with is computed in `f64`.

mod baselines;
mod bounce;
mod controller;
mod controllers;
mod curves;
mod f64_reference;
mod kinematic;
mod law_driver;
mod oracle;
mod paper;
mod report;
mod simulate;
mod suite;

use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc;
use std::thread;

use nalgebra::Point3;
use plumb_emulator::rig::RigError;
use plumb_protocol::message::ConfigField;
use thiserror::Error;

use plumb_runtime::rig::OutOfRange;
use plumb_sim::limits::Limits;
use simulate::Outcome;

pub use controller::ControllerKind;
pub use curves::draw as draw_curves;
pub use paper::{ControlError, PAPER_GAMMAS, PaperSuite, paper};
pub use report::Report;
pub use suite::{ASSUMED_LATENCY_FRAMES, Clock, Physics, Suite};

/// Why there is no result.
#[derive(Debug, Error)]
pub enum BenchError {
    /// A parameter that the board cannot be told.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// A configuration that a board would refuse.
    #[error("a board would refuse this configuration: out of range is {0}")]
    Config(ConfigField),
    /// A target that no board can be told.
    #[error("a board takes targets within 4 m, not {0}")]
    Target(Point3<f64>),
    /// A rig that cannot be.
    #[error("rig {index} of seed {seed}: {error}")]
    Rig {
        /// The rig's number.
        index: u64,
        /// The seed.
        seed: u64,
        /// What is wrong with it.
        error: RigError,
    },
}

/// Runs `controller` on rigs of a suite, by their numbers, on all cores. `progress` hears how many
/// runs are done.
///
/// # Errors
/// Where the law's parameters are out of the board's range.
pub fn run(
    controller: &ControllerKind,
    suite: &Suite,
    rigs: Range<u64>,
    seed: u64,
    progress: &mut dyn FnMut(u64),
) -> Result<Report, BenchError> {
    let next = AtomicU64::new(rigs.start);
    let workers = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let (sender, receiver) = mpsc::channel();
    let end = rigs.end;
    let mut runs: Vec<Option<(Outcome, f64)>> = vec![None; rigs.clone().count()];
    thread::scope(|scope| {
        for _ in 0..workers {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= end
                        || sender.send((index, one(controller, suite, seed, index))).is_err()
                    {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for (done, (index, result)) in (1..).zip(&receiver) {
            runs[(index - rigs.start) as usize] = Some(result?);
            progress(done);
        }
        Ok::<(), BenchError>(())
    })?;
    let runs: Vec<(Outcome, f64)> = runs.into_iter().flatten().collect();
    Ok(Report::new(controller.name(), suite.name, (seed, rigs.start), &runs))
}

/// One run and the oracle's time for its task.
fn one(
    controller: &ControllerKind,
    suite: &Suite,
    seed: u64,
    index: u64,
) -> Result<(Outcome, f64), BenchError> {
    let of_rig = |error| BenchError::Rig { index, seed, error };
    let task = suite.task(seed, index).map_err(of_rig)?;
    let oracle_s = oracle::time_s(&task, &Limits::default(), suite.threshold_m).map_err(of_rig)?;
    let mut controller =
        controller.build(suite, &task, suite.elasticity(seed, index), (seed, index))?;
    let outcome =
        simulate::run(&mut *controller, suite, &task, (seed, index), oracle_s).map_err(of_rig)?;
    Ok((outcome, oracle_s))
}

#[cfg(test)]
mod tests;
