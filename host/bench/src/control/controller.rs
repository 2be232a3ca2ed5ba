//! The controllers that the benchmark compares.

use std::fmt;
use std::str::FromStr;

use plumb_core::law::Law;
use plumb_core::params::Params;
use plumb_emulator::EMULATED;
use plumb_emulator::plant::Task;
use plumb_protocol::prior::Prior;
use plumb_protocol::units::{Micrometres, Point};
use plumb_protocol::{AXES, Config, MOTORS, Wiring};
use plumb_runtime::rig::quantity::{Delay, Mean};
use plumb_runtime::rig::{Estimating, LawName, LawSettings};
use plumb_sim::limits::RigLimits;

use super::baselines::{Broyden, Model};
use super::board_controller::BoardController;
use super::law_controller::LawController;
use super::plan_controller::PlanController;
use super::simulate::Controller;
use super::suite::Suite;
use super::{BenchError, oracle, slack_free};
use crate::UnknownName;
use crate::run_id::RunId;

/// A controller to measure.
#[derive(Debug, Clone, PartialEq)]
pub enum ControllerKind {
    /// A law of the board, on the board's own code.
    Board(LawSettings),
    /// Uncalibrated visual servoing: Broyden's updates of J with damped Gauss-Newton steps.
    Broyden {
        /// Running mean over the step plan.
        mean: Mean,
    },
    /// Inverse kinematics with a model that is wrong.
    Model {
        /// Error of geometry and pulley radius, percent.
        percent: u8,
        /// Running mean over the step plan.
        mean: Mean,
    },
    /// A perfect model without feedback: all motors synchronised, as fast as their limits allow.
    Oracle,
    /// The slack-free reference: full knowledge without feedback, through a running mean of
    /// 0.3 s.
    Reference,
}

/// Running mean of the slack-free reference, seconds.
const REFERENCE_MEAN_S: f64 = 0.3;

/// No running mean.
const NO_MEAN: Mean = Mean::constant(0.0);

/// Controllers without a law of the board.
const BASELINES: [ControllerKind; 6] = [
    ControllerKind::Broyden { mean: NO_MEAN },
    ControllerKind::Model { percent: 5, mean: NO_MEAN },
    ControllerKind::Model { percent: 10, mean: NO_MEAN },
    ControllerKind::Model { percent: 20, mean: NO_MEAN },
    ControllerKind::Oracle,
    ControllerKind::Reference,
];

impl ControllerKind {
    /// Returns every controller. Laws have the parameters of the paper's rig.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let board = LawName::ALL.into_iter().map(|name| Self::Board(name.into()));
        board.chain(BASELINES).collect()
    }

    /// Returns the parameters of the law; `None` for a baseline.
    pub fn settings_mut(&mut self) -> Option<&mut LawSettings> {
        match self {
            Self::Board(law) => Some(law),
            _ => None,
        }
    }

    /// Sets the running mean over the step plan. A controller that plays a plan has none of its
    /// own.
    pub fn set_mean(&mut self, span: Mean) {
        match self {
            Self::Board(law) => law.set_mean(span),
            Self::Broyden { mean } | Self::Model { mean, .. } => *mean = span,
            Self::Oracle | Self::Reference => {}
        }
    }

    /// Returns whether the controller can drive to a further target, and along a path: it plays no
    /// plan.
    #[must_use]
    pub const fn can_go_on(&self) -> bool {
        !matches!(self, Self::Oracle | Self::Reference)
    }

    /// Returns whether the controller can begin a further run with what it knows of the rig.
    #[must_use]
    pub const fn can_begin_again(&self) -> bool {
        matches!(self, Self::Board(_))
    }

    /// Returns whether the controller can drive rigs with this number of motors. A board refuses
    /// laws that cannot.
    #[must_use]
    pub const fn can_drive(&self, motors: usize) -> bool {
        motors == MOTORS || !matches!(self, Self::Broyden { .. } | Self::Model { .. })
    }

    /// Creates the controller of a run of `suite`.
    ///
    /// # Errors
    /// If a board refuses a parameter or the target, or the model describes no valid rig.
    pub(super) fn build(
        &self,
        suite: &Suite,
        task: &Task,
        id: RunId,
    ) -> Result<Box<dyn Controller>, BenchError> {
        let limits = RigLimits::default();
        let plan =
            |rows| -> Box<dyn Controller> { Box::new(PlanController::new(rows, suite.clock)) };
        Ok(match self {
            Self::Board(law) => {
                let (config, _) = checked(law, suite)?;
                let tape = suite.tape.filter(|_| law.name() == LawName::Taut);
                let size = tape
                    .map(|tape| tape.size(task, id))
                    .transpose()
                    .map_err(BenchError::of_rig(id))?;
                let prior = size.and_then(|size| size.prior()).map(Prior::Rig);
                let prior = prior.or(suite.prior.filter(|_| law.name() == LawName::Adaptive));
                Box::new(BoardController::new(config, prior, task.target))
            }
            Self::Broyden { mean } => Box::new(broyden(*mean, suite, task)?),
            Self::Model { percent, mean } => Box::new(model((*percent, *mean), suite, task, id)?),
            Self::Oracle => plan(oracle::trapezoids(task, &limits)),
            Self::Reference => {
                plan(slack_free::slack_free(task, &limits, REFERENCE_MEAN_S, suite.elasticity(id)))
            }
        })
    }
}

impl fmt::Display for ControllerKind {
    /// Writes the name in options, reports and JSON.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Board(law) => write!(f, "{}", law.name()),
            Self::Broyden { .. } => f.write_str("broyden"),
            Self::Model { percent, .. } => write!(f, "model-{percent}"),
            Self::Oracle => f.write_str("oracle"),
            Self::Reference => f.write_str("reference"),
        }
    }
}

impl FromStr for ControllerKind {
    type Err = UnknownName;

    fn from_str(text: &str) -> Result<Self, UnknownName> {
        let known = || UnknownName::new(Self::all());
        Self::all().into_iter().find(|kind| kind.to_string() == text).ok_or_else(known)
    }
}

/// Returns the settings of the board for baselines: no delay, and this running mean.
fn baseline_settings(mean: Mean) -> LawSettings {
    LawSettings::Adaptive(Estimating { delay: Delay::constant(0.0), mean })
}

/// Returns the configuration of a board with these `settings` in a suite, and its parameters.
///
/// # Errors
/// If a board refuses the configuration.
pub(super) fn checked(
    settings: &LawSettings,
    suite: &Suite,
) -> Result<(Config, Params), BenchError> {
    let mut config = RigLimits::default().config(
        settings.config(suite.motors())?,
        settings.mean_on(suite.cables).config("mean")?,
        suite.threshold_m,
    );
    config.motors = config.motors.up_to(suite.motors());
    for bound in [&mut config.workspace.min, &mut config.workspace.max] {
        // Two motors move the ball in the plane x = 0.
        bound.0[..AXES - suite.motors()].fill(Micrometres(0));
    }
    let params = Params::check(&config, &Wiring::example().drivers, &EMULATED)
        .map_err(BenchError::Config)?;
    Ok((config, params))
}

/// Creates the controller [`ControllerKind::Broyden`].
///
/// # Errors
/// If a board refuses the target.
pub(super) fn broyden(mean: Mean, suite: &Suite, task: &Task) -> Result<LawController, BenchError> {
    by_law(&baseline_settings(mean), suite, task, |_| Box::new(Broyden::new(RigLimits::default())))
}

/// Creates the controller [`ControllerKind::Model`] with this error in percent and this mean.
///
/// # Errors
/// If a board refuses the target, or the model describes no valid rig.
pub(super) fn model(
    (percent, mean): (u8, Mean),
    suite: &Suite,
    task: &Task,
    id: RunId,
) -> Result<LawController, BenchError> {
    let model = Model::new(task, f64::from(percent) / 100.0, RigLimits::default(), id)
        .map_err(BenchError::of_rig(id))?;
    by_law(&baseline_settings(mean), suite, task, |_| Box::new(model))
}

/// Creates the controller that runs the law made by `law` from the parameters of a board with these
/// `settings`.
///
/// # Errors
/// If a board refuses the settings or the target.
pub(super) fn by_law(
    settings: &LawSettings,
    suite: &Suite,
    task: &Task,
    law: impl FnOnce(&Params) -> Box<dyn Law>,
) -> Result<LawController, BenchError> {
    let (config, params) = checked(settings, suite)?;
    let target = Point::from_metres(task.target.into()).ok_or(BenchError::Target(task.target))?;
    Ok(LawController::new(law(&params), (config, &params), target))
}
