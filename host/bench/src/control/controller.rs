//! Who can be put to the test.

use plumb_core::law::Law;
use plumb_core::params::Params;
use plumb_emulator::EMULATED;
use plumb_emulator::rig::{ElasticParameters, Task};
use plumb_protocol::Config;
use plumb_protocol::units::Point;

use super::baselines::{Broyden, Model};
use super::controllers::{BoardController, PlanController};
use super::law_driver::LawDriver;
use super::simulate::Controller;
use super::suite::Suite;
use super::{BenchError, f64_reference, oracle};
use plumb_runtime::rig::{Estimating, LawSettings, Seconds};
use plumb_sim::limits::Limits;

/// Who drives.
#[derive(Debug, Clone, PartialEq)]
pub enum ControllerKind {
    /// One of the board's laws, on the board's code.
    Board(LawSettings),
    /// The same law written in `f64`, through the board's planner.
    F64(LawSettings),
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
const BASELINES: [(&str, ControllerKind); 6] = [
    ("broyden", ControllerKind::Broyden),
    ("model-5", ControllerKind::Model(5)),
    ("model-10", ControllerKind::Model(10)),
    ("model-20", ControllerKind::Model(20)),
    ("oracle", ControllerKind::Oracle),
    ("reference", ControllerKind::Reference(REFERENCE_MEAN_S)),
];

/// What a law's name ends in where its reference in `f64` is meant.
const F64_SUFFIX: &str = "-f64";

impl ControllerKind {
    /// Every name that [`named`](Self::named) knows.
    #[must_use]
    pub fn names() -> Vec<String> {
        let laws = LawSettings::NAMES.into_iter().map(str::to_owned);
        let f64_reference =
            f64_reference::NAMES.into_iter().map(|name| format!("{name}{F64_SUFFIX}"));
        laws.chain(f64_reference).chain(BASELINES.map(|(name, _)| name.to_owned())).collect()
    }

    /// A law with the parameters of the paper's rig, its reference, or a baseline, by its name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        if let Some((_, baseline)) = BASELINES.into_iter().find(|(known, _)| *known == name) {
            return Some(baseline);
        }
        match name.strip_suffix(F64_SUFFIX) {
            Some(law) if f64_reference::NAMES.contains(&law) => {
                LawSettings::named(law).map(Self::F64)
            }
            _ => LawSettings::named(name).map(Self::Board),
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Board(law) => law.name().to_owned(),
            Self::F64(law) => format!("{}{F64_SUFFIX}", law.name()),
            Self::Broyden => "broyden".to_owned(),
            Self::Model(percent) => format!("model-{percent}"),
            Self::Oracle => "oracle".to_owned(),
            Self::Reference(_) => "reference".to_owned(),
        }
    }

    /// The parameters of its law, where it has one.
    pub fn settings_mut(&mut self) -> Option<&mut LawSettings> {
        match self {
            Self::Board(law) | Self::F64(law) => Some(law),
            _ => None,
        }
    }

    /// What drives the ball of `task`, number `index` of `seed`, in a suite.
    ///
    /// # Errors
    /// Where a parameter is out of the board's range, or the rig cannot be.
    pub(super) fn build(
        &self,
        suite: &Suite,
        task: &Task,
        elasticity: Option<ElasticParameters>,
        (seed, index): (u64, u64),
    ) -> Result<Box<dyn Controller>, BenchError> {
        let limits = Limits::default();
        let plan =
            |rows| -> Box<dyn Controller> { Box::new(PlanController::new(rows, suite.clock)) };
        Ok(match self {
            Self::Board(law) => {
                let (config, _) = checked(law, suite)?;
                Box::new(BoardController::new(config, task.target))
            }
            Self::F64(law) => {
                by_law(law, suite, task, |params| f64_reference::of(law, params, limits))?
            }
            Self::Broyden => {
                by_law(&BASELINE_SETTINGS, suite, task, |_| Box::new(Broyden::new(limits)))?
            }
            Self::Model(percent) => {
                let model = Model::new(task, f64::from(*percent) / 100.0, limits, (seed, index))
                    .map_err(|error| BenchError::Rig { index, seed, error })?;
                by_law(&BASELINE_SETTINGS, suite, task, |_| Box::new(model))?
            }
            Self::Oracle => plan(oracle::trapezoids(task, &limits)),
            Self::Reference(mean_s) => plan(oracle::slack_free(task, &limits, *mean_s, elasticity)),
        })
    }
}

/// What baselines take from the board's settings: no delay, no running mean.
const BASELINE_SETTINGS: LawSettings =
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
) -> Result<Box<dyn Controller>, BenchError> {
    let (config, params) = checked(settings, suite)?;
    let target = Point::from_metres(task.target.into()).ok_or(BenchError::Target(task.target))?;
    Ok(Box::new(LawDriver::new(law(&params), (config, &params), target)))
}
