//! Who can be put to the test.

use plumb_core::law::Law;
use plumb_core::params::Params;
use plumb_emulator::EMULATED;
use plumb_emulator::rig::{ElasticParameters, Task};
use plumb_protocol::Config;
use plumb_protocol::units::Point;

use super::drivers::{BoardDriver, PlanDriver};
use super::law_driver::LawDriver;
use super::peers::{Broyden, Model};
use super::simulate::Driver;
use super::suite::Suite;
use super::{BenchError, oracle, twins};
use plumb_runtime::rig::{Estimating, LawSettings, Seconds};
use plumb_sim::limits::Limits;

/// Who drives.
#[derive(Debug, Clone, PartialEq)]
pub enum Contender {
    /// One of the board's laws, on the board's code.
    Board(LawSettings),
    /// The same law written in `f64`, through the board's planner.
    Twin(LawSettings),
    /// Uncalibrated servoing: Broyden's updates of J, damped Gauss-Newton.
    Broyden,
    /// Inverse kinematics with a geometry and a pulley radius that are wrong by so many percent.
    Model(u8),
    /// A perfect model, all motors in step as fast as their limits allow, no feedback.
    Oracle,
    /// The slack-free reference through a running mean of so many seconds: full knowledge, no
    /// feedback.
    Reference(f64),
}

/// Running mean of the slack-free reference, seconds.
const REFERENCE_MEAN_S: f64 = 0.3;

/// Names and what they stand for, besides the board's laws.
const PEERS: [(&str, Contender); 6] = [
    ("broyden", Contender::Broyden),
    ("model-5", Contender::Model(5)),
    ("model-10", Contender::Model(10)),
    ("model-20", Contender::Model(20)),
    ("oracle", Contender::Oracle),
    ("reference", Contender::Reference(REFERENCE_MEAN_S)),
];

/// What a law's name ends in where its twin in `f64` is meant.
const TWIN: &str = "-f64";

impl Contender {
    /// Every name that [`named`](Self::named) knows.
    #[must_use]
    pub fn names() -> Vec<String> {
        let laws = LawSettings::NAMES.into_iter().map(str::to_owned);
        let twins = twins::NAMES.into_iter().map(|name| format!("{name}{TWIN}"));
        laws.chain(twins).chain(PEERS.map(|(name, _)| name.to_owned())).collect()
    }

    /// A law with the parameters of the paper's rig, its twin, or a peer, by its name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        if let Some((_, peer)) = PEERS.into_iter().find(|(known, _)| *known == name) {
            return Some(peer);
        }
        match name.strip_suffix(TWIN) {
            Some(law) if twins::NAMES.contains(&law) => LawSettings::named(law).map(Self::Twin),
            _ => LawSettings::named(name).map(Self::Board),
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Board(law) => law.name().to_owned(),
            Self::Twin(law) => format!("{}{TWIN}", law.name()),
            Self::Broyden => "broyden".to_owned(),
            Self::Model(percent) => format!("model-{percent}"),
            Self::Oracle => "oracle".to_owned(),
            Self::Reference(_) => "reference".to_owned(),
        }
    }

    /// The parameters of its law, where it has one.
    pub fn settings_mut(&mut self) -> Option<&mut LawSettings> {
        match self {
            Self::Board(law) | Self::Twin(law) => Some(law),
            _ => None,
        }
    }

    /// What drives the ball of `task`, number `index` of `seed`, in a suite.
    ///
    /// # Errors
    /// Where a parameter is out of the board's range, or the rig cannot be.
    pub(super) fn driver(
        &self,
        suite: &Suite,
        task: &Task,
        elasticity: Option<ElasticParameters>,
        (seed, index): (u64, u64),
    ) -> Result<Box<dyn Driver>, BenchError> {
        let limits = Limits::default();
        let plan = |rows| -> Box<dyn Driver> { Box::new(PlanDriver::new(rows, suite.clock)) };
        Ok(match self {
            Self::Board(law) => {
                let (config, _) = checked(law, suite)?;
                Box::new(BoardDriver::new(config, task.target))
            }
            Self::Twin(law) => by_law(law, suite, task, |params| twins::of(law, params, limits))?,
            Self::Broyden => by_law(&PEERS_OWN, suite, task, |_| Box::new(Broyden::new(limits)))?,
            Self::Model(percent) => {
                let model = Model::new(task, f64::from(*percent) / 100.0, limits, (seed, index))
                    .map_err(|error| BenchError::Rig { index, seed, error })?;
                by_law(&PEERS_OWN, suite, task, |_| Box::new(model))?
            }
            Self::Oracle => plan(oracle::trapezoids(task, &limits)),
            Self::Reference(mean_s) => plan(oracle::slack_free(task, &limits, *mean_s, elasticity)),
        })
    }
}

/// What peers take from the board's settings: no delay, no running mean.
const PEERS_OWN: LawSettings =
    LawSettings::Adaptive(Estimating { delay: Seconds::ZERO, mean: Seconds::ZERO });

/// The configuration of a board with these `settings` in a suite, and its parameters.
///
/// # Errors
/// Where a board would refuse it.
fn checked(settings: &LawSettings, suite: &Suite) -> Result<(Config, Params), BenchError> {
    let config = Limits::default().config(
        settings.config()?,
        settings.mean().config("mean")?,
        suite.threshold_m,
    );
    let params = Params::check(&config, &EMULATED).map_err(BenchError::Config)?;
    Ok((config, params))
}

/// The driver with what `law` makes of the parameters of a board with these `settings`.
///
/// # Errors
/// Where a board would refuse them.
pub(super) fn by_law(
    settings: &LawSettings,
    suite: &Suite,
    task: &Task,
    law: impl FnOnce(&Params) -> Box<dyn Law>,
) -> Result<Box<dyn Driver>, BenchError> {
    let (config, params) = checked(settings, suite)?;
    let target = Point::from_metres(task.target.into()).ok_or(BenchError::Target(task.target))?;
    Ok(Box::new(LawDriver::new(law(&params), (config, &params), target)))
}
