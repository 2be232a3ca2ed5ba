//! A run: connects to the board, configures it, and drives the ball through a list of targets.

mod chase;
mod control_loop;
mod core;
mod error;
mod first_and_last;
mod follow_file;
mod goal;
mod path;
mod plausibility;
mod reached;
mod repetition;
mod sent_positions;
mod targets;
mod waypoint;

use std::time::Duration;

use plumb_config::error_chain::ErrorChain;
use plumb_protocol::MotorList;
use plumb_protocol::config::{Config, Workspace};
use plumb_protocol::message::Fault;
use plumb_protocol::units::Steps16;
use plumb_protocol::wiring::Wiring;
use tracing::info;

use self::core::{RunCore, Settings};
use crate::board_report::BoardReport;
use crate::link::{Link, LinkError, Serial, Transport};
use crate::rig::{MotionRules, Rig};
use crate::rounding::{millimetres, round};
use crate::targets::TargetSource;
use control_loop::ControlLoop;
use path::PathDrive;
use plausibility::BallSpeed;
use repetition::RepetitionDetector;
use targets::{TargetDrive, TargetRules};
use waypoint::Route;

pub use crate::deviation::{PathPoint, PathSummary, Spread, Spreads};
pub use crate::stop_reason::StopReason;
pub use crate::summary::{Leg, Summary};
pub use crate::targets_summary::TargetsSummary;
pub use control_loop::{DEFAULT_TIMEOUT, RunParts};
pub use error::{ControlLoopError, RunError};
pub use follow_file::{FollowFile, FollowFileError, misplaced};
pub use path::{PathPlan, PathPlanError};
pub use repetition::RepeatedPicture;
pub use targets::TargetUse;
pub use waypoint::Waypoint;

/// Time for which the ball waits at the start of a path, seconds. "Reached" is told while the ball
/// still comes to rest, up to half of the radius from the target. Without this time a path began
/// with a deviation of 4.1 mm (`plumb demo --virtual-time --follow eight --upright`).
const REST_BEFORE_PATH_S: f64 = 0.5;

/// Source of targets that move.
type BoxedTargets = Box<dyn TargetSource>;

/// A run that is ready to begin: the board is connected and configured, and its motors stand still.
pub struct Run<T> {
    link: Link<T>,
    route: Route,
    /// Path that follows the route.
    path: Option<PathPlan>,
    /// Source of targets that move, and what they are for.
    targets: Option<(BoxedTargets, TargetUse)>,
    rules: MotionRules,
    /// Largest speed of a reference, m/s.
    max_speed: f64,
    law: &'static str,
    radius: f64,
    workspace: Workspace,
    /// Largest speed of the ball, m/s.
    ball_speed: BallSpeed,
    /// Farthest turn of a motor without the ball, of the rig file.
    following_turn: Steps16,
    /// Fault of an earlier run that this run has cleared.
    cleared: Option<Fault>,
    /// Whether the law begins with what the rig file tells of the rig.
    has_prior: bool,
}

impl Run<Serial> {
    /// Opens the serial port of the rig file, connects to the board on it and configures it, as
    /// [`connect`](Self::connect).
    ///
    /// # Errors
    /// [`RunError::Connect`] where the port cannot be opened; as [`connect`](Self::connect).
    pub fn open(rig: &Rig) -> Result<Self, RunError> {
        let port = Serial::open(&rig.board.port, rig.board.baud).map_err(RunError::Connect)?;
        Self::connect(rig, port)
    }
}

/// Configures the board. Returns the fault that was cleared for it.
fn configure<T: Transport>(
    link: &mut Link<T>,
    wiring: Wiring,
    config: Config,
) -> Result<Option<Fault>, LinkError> {
    match link.configure(wiring, config) {
        Err(LinkError::Faulted { fault: fault @ Fault::HostSilent, .. }) => {
            link.clear_fault()?;
            link.configure(wiring, config)?;
            Ok(Some(fault))
        }
        result => result.map(|()| None),
    }
}

/// End of a run.
struct Ending {
    /// Whether every target was reached.
    reached: bool,
    /// Whether every target was reached, or the ball hung there already.
    is_done: bool,
    /// Whether the board reported that its motors stand still.
    at_rest: bool,
    reason: StopReason,
    /// Message of the error that broke the run after a fault.
    failure: Option<String>,
}

/// Returns the route through the targets of `rig`.
///
/// # Errors
/// Where there are none, or one is outside the workspace or the triangle of the motors.
fn route(rig: &Rig) -> Result<Route, RunError> {
    let targets = rig.targets().map_err(RunError::Config)?;
    let targets: Vec<Waypoint> =
        targets.iter().map(|target| Waypoint::new(target.to_metres())).collect();
    Route::new(&targets, false, &rig.motion_rules())
}

/// Checks the targets of `rig`, as [`Run::connect`] does, without a board.
///
/// # Errors
/// Where there are none, or one is outside the workspace or the triangle of the motors.
pub fn check_targets(rig: &Rig) -> Result<(), RunError> {
    match rig.targets.is_empty() {
        true => Err(RunError::NoTargets),
        false => waypoint::check(&rig.wrong_targets()),
    }
}

impl<T: Transport> Run<T> {
    /// Checks the targets of `rig`, connects to the board at the other end of `transport`, and
    /// configures it. [`Fault::HostSilent`] of an earlier run is cleared, because this host ends
    /// its cause; [`cleared_fault`](Self::cleared_fault) returns it.
    ///
    /// # Errors
    /// Where the rig file has no valid targets, or the board does not answer, stands in another
    /// fault or refuses the configuration.
    pub fn connect(rig: &Rig, transport: T) -> Result<Self, RunError> {
        Self::check(rig)?;
        Self::on(rig, Link::connect(transport).map_err(RunError::Connect)?)
    }

    /// Checks the rig file as far as [`connect`](Self::connect) does.
    fn check(rig: &Rig) -> Result<(Wiring, Config, Route), RunError> {
        let wiring = rig.wiring().map_err(RunError::Config)?;
        let config = rig.config().map_err(RunError::Config)?;
        Ok((wiring, config, route(rig)?))
    }

    /// Configures the board at the other end of `link`, as [`connect`](Self::connect).
    ///
    /// # Errors
    /// As [`connect`](Self::connect).
    pub fn on(rig: &Rig, mut link: Link<T>) -> Result<Self, RunError> {
        let (wiring, config, route) = Self::check(rig)?;
        let rules = rig.motion_rules();
        let cleared = configure(&mut link, wiring, config).map_err(RunError::Connect)?;
        let prior = rig.prior();
        if let Some(prior) = prior {
            link.know(prior).map_err(RunError::Connect)?;
        }
        let (law, radius) = (rig.law.name().as_str(), rig.reached.radius.get());
        let (workspace, following_turn) = (config.workspace, config.following.turn);
        Ok(Self {
            link,
            route,
            path: None,
            targets: None,
            rules,
            max_speed: rig.path.max_speed.get(),
            law,
            radius,
            workspace,
            ball_speed: BallSpeed {
                max: rig.max_ball_speed(),
                motor_rate: 16.0 * rig.motors.max_rate.get(),
            },
            following_turn,
            cleared,
            has_prior: prior.is_some(),
        })
    }

    /// Returns the fault of an earlier run that this run has cleared, for the user to know.
    #[must_use]
    pub fn cleared_fault(&self) -> Option<Fault> {
        self.cleared
    }

    /// Returns whether the law begins with the size in the rig file, unless the board has learnt
    /// the rig in an earlier run.
    #[must_use]
    pub fn has_prior(&self) -> bool {
        self.has_prior
    }

    /// Returns the shortest time from a request to the board to its answer so far.
    pub fn answer_time(&self) -> Option<Duration> {
        self.link.answer_time()
    }

    /// Replaces the targets of the rig file by waypoints, driven to in their order; with
    /// `is_repeated` again and again until the run is interrupted.
    ///
    /// # Errors
    /// Where there are none, or one is outside the workspace or the triangle of the motors.
    pub fn set_waypoints(
        &mut self,
        waypoints: &[Waypoint],
        is_repeated: bool,
    ) -> Result<(), RunError> {
        self.route = Route::new(waypoints, is_repeated, &self.rules)?;
        Ok(())
    }

    /// Replaces the targets of the rig file by a path: the ball drives to its start, and then
    /// follows it to its end; a loop until the run is interrupted.
    ///
    /// # Errors
    /// Where the start is outside the workspace of the rig file that this run has.
    pub fn set_path(&mut self, plan: PathPlan) -> Result<(), RunError> {
        let begin = plan.trajectory().at(0.0).position;
        let begin = Waypoint { dwell_s: REST_BEFORE_PATH_S, ..Waypoint::new(begin.into()) };
        self.set_waypoints(&[begin], false)?;
        self.path = Some(plan);
        Ok(())
    }

    /// Has the ball follow the targets of `source`, which move. As the goal of the run
    /// ([`TargetUse::Goal`]) they replace the targets of the rig file. Without this, a run with an
    /// operator follows those of [`OperatorSender::targets`](crate::operator::OperatorSender).
    pub fn set_targets(&mut self, source: Box<dyn TargetSource>, usage: TargetUse) {
        if usage == TargetUse::Goal {
            self.route = Route { waypoints: Vec::new(), is_repeated: false };
        }
        self.targets = Some((source, usage));
    }

    /// Returns the number of targets of the list; `None` where the list is repeated, or is empty
    /// since the targets move. A path counts as one target more.
    pub fn target_count(&self) -> Option<usize> {
        let count = self.route.waypoints.len() + usize::from(self.path.is_some());
        (count > 0 && !self.route.is_repeated).then_some(count)
    }

    /// Returns the motor positions of the board, full steps from the zero of travel, + pays out.
    ///
    /// # Errors
    /// Where the link fails.
    pub fn motors(&mut self) -> Result<MotorList<f64>, LinkError> {
        Ok(BoardReport::from(&self.link.status()?).motors)
    }

    /// Drives the ball to one target after the other until one is not reached. With an
    /// [operator](mod@crate::operator) the run goes on until the operator ends it. The motors are
    /// ramped down at the end.
    ///
    /// # Errors
    /// [`RunError::NotLive`], before the board receives a target, where the age of the source's
    /// frames is unknown. [`RunError::Broken`] where the link, the camera or an observer fails. The
    /// observers receive the summary in that case too.
    pub fn drive(mut self, mut parts: RunParts<'_>) -> Result<Summary, RunError> {
        if !parts.source.is_live() {
            return Err(RunError::NotLive);
        }
        info!(law = self.law, timeout_s = parts.timeout, "beginning the run");
        let (source, targets) = self.target_drive(&mut parts).unzip();
        let repetition = RepetitionDetector::new(self.following_turn);
        let core = RunCore::new(self.settings(&parts), &self.route, self.path.take(), targets);
        self.link.count_late_wakeups();
        let mut control = ControlLoop::new(&mut parts, &mut self.link, core, source, repetition);
        let result = control.run();
        let core = control.into_core();
        let is_ended = result.is_ok();
        let reached = is_ended && core.legs.all_reached();
        let is_done = is_ended && core.legs.all_done();
        let fault = result.as_ref().ok().and_then(StopReason::fault);
        let (result, at_rest) = come_to_rest(&mut self.link, result);
        let reason = match &result {
            Ok(reason) => reason.clone(),
            Err(error) => error.ending(fault.or(self.link.board_fault())),
        };
        let failure = result.as_ref().err().filter(|_| reason.fault().is_some());
        let failure = failure.map(|error| ErrorChain(error).to_string());
        let ending = Ending { reached, is_done, at_rest, reason, failure };
        let summary = self.summary(&parts, core, ending);
        info!(
            ending = %summary.ending,
            time_s = summary.time_s,
            frames = summary.frames,
            located = summary.located,
            lost = summary.lost,
            skipped = summary.skipped,
            at_rest = summary.at_rest,
            "ended the run"
        );
        for observer in parts.observers.iter_mut() {
            observer.end(&summary);
        }
        match result {
            Ok(_) => Ok(summary),
            Err(error) => Err(RunError::Broken { error, summary: summary.into() }),
        }
    }

    /// Returns the settings of the run's core.
    fn settings(&self, parts: &RunParts<'_>) -> Settings {
        Settings {
            radius: self.radius,
            rules: self.rules.clone(),
            timeout: parts.timeout,
            is_operated: parts.operator.is_some(),
            ball_speed: self.ball_speed,
            following_turn: self.following_turn,
        }
    }

    /// Returns the source of targets that move, and the drive after them, where a source was set or
    /// there is an operator.
    fn target_drive(&mut self, parts: &mut RunParts<'_>) -> Option<(BoxedTargets, TargetDrive)> {
        let of_operator = || {
            let targets = parts.operator.as_mut()?.take_targets()?;
            Some((Box::new(targets) as BoxedTargets, TargetUse::Steering))
        };
        let (source, usage) = self.targets.take().or_else(of_operator)?;
        let Self { workspace, max_speed, radius, .. } = *self;
        let rules = TargetRules { motion: self.rules.clone(), workspace, max_speed, radius };
        Some((source, TargetDrive::new(usage, rules)))
    }

    /// Returns the summary of a run that ended.
    fn summary(&self, parts: &RunParts<'_>, core: RunCore, ending: Ending) -> Summary {
        let stats = core.stats;
        let path = core.path().and_then(PathDrive::summary);
        let targets = core.targets.as_ref().and_then(TargetDrive::summary);
        let (targets_reached, legs) = (core.legs.reached(), core.legs.into_ended());
        Summary {
            reached: ending.reached,
            is_done: ending.is_done,
            law: self.law,
            detector: parts.detector.name(),
            frames: stats.frames,
            time_s: round(stats.time, 1e6),
            filtered_error_mm: stats.error.map(millimetres),
            targets_reached,
            legs_left_out: legs.left_out(),
            legs: legs.into_kept(),
            events_left_out: core.events.left_out(),
            events: core.events.into_kept(),
            path,
            targets,
            at_rest: ending.at_rest,
            located: stats.located,
            lost: stats.lost,
            skipped: stats.skipped,
            late_wakeups: self.link.late_wakeups(),
            refused_positions: self.link.refused_positions(),
            ending: ending.reason,
            failure: ending.failure,
            dropped_records: parts.observers.iter().map(|observer| observer.dropped()).sum(),
        }
    }
}

/// Ramps the motors down and waits until they stand still. Returns the result of the run, and
/// whether the board reported that they stand.
fn come_to_rest<T: Transport>(
    link: &mut Link<T>,
    result: Result<StopReason, ControlLoopError>,
) -> (Result<StopReason, ControlLoopError>, bool) {
    let is_link_lost = matches!(
        &result,
        Err(ControlLoopError::Link(error)) if !matches!(error, LinkError::Refused { .. })
    );
    if is_link_lost {
        // The first cause counts, and a board without a host stops by itself.
        link.abandon();
        return (result, false);
    }
    match link.stop() {
        Ok(()) => (result, true),
        Err(error) => (result.and(Err(error.into())), false),
    }
}
