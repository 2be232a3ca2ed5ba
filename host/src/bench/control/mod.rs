//! `plumb bench control`: laws against each other and against what is possible, on random rigs, in virtual time.
//!
//! Our laws run as the board runs them: frames in, step counts out, in the chip's arithmetic. What they are compared
//! with is computed in `f64`.

mod bounce;
mod curves;
mod drivers;
mod kinematic;
mod limits;
mod oracle;
mod paper;
mod report;
mod simulate;
mod suite;

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc;
use std::thread;

use plumb_emulator::rig::{ElasticParameters, RigError, Task};
use thiserror::Error;

use crate::rig::{LawSettings, OutOfRange};
use drivers::{BoardDriver, PlanDriver};
use simulate::{Driver, Outcome};

pub use curves::draw as draw_curves;
pub use limits::Limits;
pub use paper::{ControlError, PAPER_GAMMAS, PaperSuite, paper};
pub use report::Report;
pub use suite::{ASSUMED_LATENCY_FRAMES, Physics, Suite};

/// Who drives.
#[derive(Debug, Clone, PartialEq)]
pub enum Contender {
    /// One of the board's laws, on the board's code.
    Board(LawSettings),
    /// The slack-free reference through a running mean of so many seconds: full knowledge, no feedback.
    Reference(f64),
}

impl Contender {
    /// Every name that [`named`](Self::named) knows.
    #[must_use]
    pub fn names() -> Vec<&'static str> {
        LawSettings::NAMES.into_iter().chain(["reference"]).collect()
    }

    /// A law with the parameters of the paper's rig, or a peer, by its name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "reference" => Some(Self::Reference(0.3)),
            _ => LawSettings::named(name).map(Self::Board),
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Board(law) => law.name().to_owned(),
            Self::Reference(_) => "reference".to_owned(),
        }
    }

    fn driver(
        &self,
        suite: &Suite,
        task: &Task,
        elasticity: Option<ElasticParameters>,
    ) -> Result<Box<dyn Driver>, BenchError> {
        let limits = Limits::default();
        Ok(match self {
            Self::Board(law) => {
                let config = limits.config(law.config()?, law.mean().config("mean")?, suite.threshold_m);
                Box::new(BoardDriver::new(config, task.target))
            }
            Self::Reference(mean_s) => {
                Box::new(PlanDriver::new(oracle::slack_free(task, &limits, *mean_s, elasticity)))
            }
        })
    }
}

/// Why there is no result.
#[derive(Debug, Error)]
pub enum BenchError {
    /// A parameter that the board cannot be told.
    #[error(transparent)]
    Range(#[from] OutOfRange),
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

/// Runs `contender` on `rigs` rigs of a suite, on all cores. `progress` hears how many runs are done.
///
/// # Errors
/// Where the law's parameters are out of the board's range.
pub fn run(
    contender: &Contender,
    suite: &Suite,
    rigs: u64,
    seed: u64,
    progress: &mut dyn FnMut(u64),
) -> Result<Report, BenchError> {
    let next = AtomicU64::new(0);
    let workers = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let (sender, receiver) = mpsc::channel();
    let mut runs: Vec<Option<(Outcome, f64)>> = vec![None; rigs as usize];
    thread::scope(|scope| {
        for _ in 0..workers {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= rigs || sender.send((index, one(contender, suite, seed, index))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for (done, (index, result)) in (1..).zip(&receiver) {
            runs[index as usize] = Some(result?);
            progress(done);
        }
        Ok::<(), BenchError>(())
    })?;
    let runs: Vec<(Outcome, f64)> = runs.into_iter().flatten().collect();
    Ok(Report::new(contender.name(), suite.name, seed, &runs))
}

/// One run and the oracle's time for its task.
fn one(contender: &Contender, suite: &Suite, seed: u64, index: u64) -> Result<(Outcome, f64), BenchError> {
    let of_rig = |error| BenchError::Rig { index, seed, error };
    let task = suite.task(seed, index).map_err(of_rig)?;
    let oracle_s = oracle::time_s(&task, &Limits::default(), suite.threshold_m).map_err(of_rig)?;
    let mut driver = contender.driver(suite, &task, suite.elasticity(seed, index))?;
    let outcome = simulate::run(&mut *driver, suite, &task, (seed, index), oracle_s).map_err(of_rig)?;
    Ok((outcome, oracle_s))
}

#[cfg(test)]
mod tests;
