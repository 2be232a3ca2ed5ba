//! One run: a controller, a rig and a camera in virtual time.

use std::fmt;

use nalgebra::Point3;
use plumb_core::TICK_US;
use plumb_emulator::plant::{CameraMonitor, Geometry, Plant, Task};
use plumb_protocol::message::Fault;
use plumb_protocol::units::Micros;
use plumb_protocol::{MOTORS, PerMotor};

use super::BenchError;
use super::eye::{Broken, PictureView};
use super::suite::{Clock, Suite};
use super::turned_frame::TurnedFrame;
use crate::run_id::RunId;

/// Ticks between two steps of the plant.
pub(super) const TICKS_PER_STEP: u64 = 5;
/// Time between two steps of the plant, seconds: 1 ms.
pub(super) const STEP_S: f64 = 1e-6 * (TICKS_PER_STEP * TICK_US as u64) as f64;

/// Time from "reached" to the start of the hold test, seconds.
const SETTLE_S: f64 = 1.0;
/// Duration of the hold test, seconds.
const HOLD_S: f64 = 3.0;
/// Least share of the hold test that the ball must spend within the threshold.
const MIN_HELD: f64 = 0.95;

/// Ticks of the pause between two runs: 0.5 s.
const REST_TICKS: u64 = 500_000 / TICK_US as u64;

/// Time limit of a run in multiples of the oracle's time.
const TIME_LIMIT_ORACLES: f64 = 15.0;
/// Time limit of a run in addition to that, seconds.
const TIME_LIMIT_S: f64 = 30.0;

/// A controller under test: receives ball positions and moves motors.
pub(crate) trait Controller {
    /// Handles a frame that arrives at `now`. `age_us` is its assumed age, µs; `ball` the measured
    /// position in metres, rig frame.
    fn on_position(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>);
    /// Runs the motors for the tick that begins at `now`. Returns their positions at its end, full
    /// steps; + pays cable out.
    fn tick(&mut self, now: Micros) -> PerMotor<f64>;
    /// Returns whether the controller has reported that the ball reached its target.
    fn reached(&self) -> bool;
    /// Drives to another target from `now` on, metres in the rig frame. A controller whose kind
    /// [cannot go on](super::ControllerKind::can_go_on) gets none.
    fn set_target(&mut self, _now: Micros, _target: Point3<f64>) {}
    /// Ends the run: the motors come to rest. A controller whose kind [cannot begin
    /// again](super::ControllerKind::can_begin_again) is never told so.
    fn end_run(&mut self, _now: Micros) {}
    /// Begins another run to a target, metres in the rig frame, with motors at rest.
    fn begin_run(&mut self, _now: Micros, _target: Point3<f64>) {}
    /// Returns whether the controller has given up.
    fn failed(&self) -> bool;
    /// Returns the fault in which the controller stands.
    fn fault(&self) -> Option<Fault> {
        None
    }
    /// Returns whether the controller stopped for a lost position and was started again.
    fn resumed(&self) -> bool {
        false
    }
}

/// End of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RunEnd {
    /// The hold test ended with the ball at its target.
    #[default]
    Held,
    /// The hold test ended after the ball had left its target.
    NotHeld,
    /// The jogs before the run gave no frame.
    NoFrame,
    /// The controller gave up.
    GaveUp,
    /// The time limit passed.
    TimedOut,
    /// The rig could not follow its motors.
    PlantFailed,
}

impl fmt::Display for RunEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Held => "held its target",
            Self::NotHeld => "left its target",
            Self::NoFrame => "the jogs gave no frame",
            Self::GaveUp => "gave up",
            Self::TimedOut => "took too long",
            Self::PlantFailed => "the rig could not follow",
        })
    }
}

/// Result of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Outcome {
    /// Time of the ball's first arrival within the threshold, seconds on the suite's clock; `None`
    /// if the run did not end with [`RunEnd::Held`].
    pub(crate) time_s: Option<f64>,
    /// Time from that arrival to the report of "reached", seconds; negative where it came before.
    pub(crate) told_s: Option<f64>,
    /// Longest total time that one cable was slack, seconds.
    pub(crate) slack_s: f64,
    /// Distances from the target during the hold test, metres, one a millisecond.
    pub(crate) hold_m: Vec<f32>,
    /// Whether "reached" was reported with the ball outside the threshold.
    pub(crate) false_reached: bool,
    /// Whether the controller stopped for a lost position and was started again.
    pub(crate) resumed: bool,
    /// End of the run.
    pub(crate) end: RunEnd,
    /// Fault with which a board gave up, and when, seconds on the suite's clock.
    pub(crate) fault: Option<(Fault, f64)>,
}

/// Measurements of a run in progress.
struct Monitor {
    /// Place at which the camera measures the target, metres.
    target: Point3<f64>,
    threshold_m: f64,
    /// Start of the clock, which is the same for all controllers, seconds.
    start_s: Option<f64>,
    /// Time limit, seconds.
    limit_s: f64,
    /// First arrival within the threshold, seconds on the suite's clock.
    arrived_s: Option<f64>,
    /// Total time that each cable was slack, seconds.
    slack_s: PerMotor<f64>,
    /// First report of "reached", seconds.
    reached_s: Option<f64>,
    outcome: Outcome,
}

impl Monitor {
    /// Begins to measure a drive to `target`, whose clock starts at `start_s`, or with the first
    /// picture.
    fn new(suite: &Suite, target: Point3<f64>, start_s: Option<f64>, limit_s: f64) -> Self {
        Self {
            target,
            threshold_m: suite.threshold_m,
            start_s,
            limit_s,
            arrived_s: None,
            slack_s: [0.0; MOTORS],
            reached_s: None,
            outcome: Outcome::default(),
        }
    }

    /// Measures the plant at `t` seconds. Returns whether the hold test is over.
    fn step(&mut self, t: f64, plant: &dyn Plant, view: Option<&View>, reached: bool) -> bool {
        let distance = match view {
            Some(View::Picture(view)) => {
                view.measured(t, plant.ball()) - view.measured(0.0, self.target)
            }
            Some(View::Turned(_)) | None => plant.ball() - self.target,
        };
        let distance = distance.norm();
        let inside = distance <= self.threshold_m;
        for (sum, slack) in self.slack_s.iter_mut().zip(plant.slack()) {
            *sum += if slack { STEP_S } else { 0.0 };
        }
        if inside {
            let start = self.start_s.unwrap_or(0.0);
            self.arrived_s.get_or_insert(t - start);
        }
        if reached && self.reached_s.is_none() {
            self.reached_s = Some(t);
            self.outcome.false_reached = !inside;
        }
        let Some(since) = self.reached_s.filter(|_| self.arrived_s.is_some()) else { return false };
        if t >= since + SETTLE_S {
            self.outcome.hold_m.push(distance as f32);
        }
        t >= since + SETTLE_S + HOLD_S
    }

    /// Returns the result of a run that ended with `end`.
    fn outcome(self, end: RunEnd, resumed: bool) -> Outcome {
        let slack_s = self.slack_s.into_iter().fold(0.0, f64::max);
        let hold = &self.outcome.hold_m;
        let inside = hold.iter().filter(|d| f64::from(**d) <= self.threshold_m).count();
        let held = inside as f64 >= MIN_HELD * hold.len() as f64;
        let end = if end == RunEnd::Held && !held { RunEnd::NotHeld } else { end };
        let time_s = self.arrived_s.filter(|_| end == RunEnd::Held);
        let start = self.start_s.unwrap_or(0.0);
        let told_s = time_s.zip(self.reached_s).map(|(time, reached)| reached - start - time);
        Outcome { time_s, told_s, slack_s, end, resumed, ..self.outcome }
    }
}

/// A run in progress.
struct Simulation<'a> {
    controller: &'a mut dyn Controller,
    suite: &'a Suite,
    id: RunId,
    plant: Box<dyn Plant>,
    camera: CameraMonitor,
    /// Map from true to measured positions; `None` where they are the same.
    view: Option<View>,
    /// Age of each frame where the board does not get the true one, µs.
    assumed_age_us: u32,
    /// Frames captured so far.
    frames: u32,
    /// Ticks of the board so far.
    ticks: u64,
    /// Positions of the motors after the last tick, full steps.
    motors: PerMotor<f64>,
    /// Positions of the motors with which the plant began, full steps.
    zero: PerMotor<f64>,
}

impl Simulation<'_> {
    /// Drives to target `number`. The first one is that with which the controller was made.
    fn drive(&mut self, number: usize, leg: &Leg) -> Outcome {
        let is_new_run = number == 0 || self.suite.new_runs.is_some();
        if number > 0 && is_new_run {
            if let Err(end) = self.begin_run(leg) {
                return Outcome { end, ..Outcome::default() };
            }
        } else if number > 0 {
            self.controller.set_target(self.now(), leg.target);
        }
        let t = self.now().0 as f64 * 1e-6;
        let start_s = match (is_new_run, self.suite.clock) {
            (true, Clock::Picture) => None,
            _ => Some(t),
        };
        let target = self.view.as_ref();
        let target = target.map_or(leg.target, |view| view.true_position(leg.target));
        let mut monitor = Monitor::new(self.suite, target, start_s, t + leg.limit_s());
        let end = loop {
            if let Some(end) = self.tick(&mut monitor) {
                break end;
            }
        };
        monitor.outcome(end, self.controller.resumed())
    }

    /// Ends the run, and begins that of `leg` after a pause in which nothing is measured.
    ///
    /// # Errors
    /// The end of the run where the ball does not hang in the changed rig, or a run has ended in
    /// the pause.
    fn begin_run(&mut self, leg: &Leg) -> Result<(), RunEnd> {
        self.controller.end_run(self.now());
        let mut ignored = Monitor::new(self.suite, leg.target, None, f64::INFINITY);
        for _ in 0..REST_TICKS {
            self.tick(&mut ignored).map_or(Ok(()), Err)?;
        }
        if let Some(geometry) = leg.changed {
            let task = Task { geometry, start: self.plant.ball(), target: leg.target };
            let plant = self.suite.plant(&task, self.id).map_err(|_| RunEnd::PlantFailed)?;
            (self.plant, self.zero) = (plant, self.motors);
        }
        self.controller.begin_run(self.now(), leg.target);
        Ok(())
    }

    /// Returns the time of the coming tick.
    fn now(&self) -> Micros {
        Micros(self.ticks * u64::from(TICK_US))
    }

    /// Runs one tick. Returns the end of the run once there is one.
    fn tick(&mut self, monitor: &mut Monitor) -> Option<RunEnd> {
        let now = self.now();
        let t = now.0 as f64 * 1e-6;
        if self.controller.failed() {
            let since = t - monitor.start_s.unwrap_or(0.0);
            monitor.outcome.fault = self.controller.fault().map(|fault| (fault, since));
            return Some(RunEnd::GaveUp);
        }
        if t > monitor.limit_s {
            return Some(RunEnd::TimedOut);
        }
        self.run_camera(now, t, monitor);
        self.motors = self.controller.tick(now);
        self.ticks += 1;
        if !self.ticks.is_multiple_of(TICKS_PER_STEP) {
            return None;
        }
        let turned = std::array::from_fn(|k| self.motors[k] - self.zero[k]);
        if self.plant.advance(STEP_S, turned).is_err() {
            return Some(RunEnd::PlantFailed);
        }
        let t = t + 1e-6 * f64::from(TICK_US);
        monitor
            .step(t, &*self.plant, self.view.as_ref(), self.controller.reached())
            .then_some(RunEnd::Held)
    }

    /// Returns the measured `position` as a host sends it to a board with the rig's number of
    /// motors: with x = 0 for two.
    fn in_plane(&self, position: Point3<f64>) -> Point3<f64> {
        let x = if self.suite.motors() < MOTORS { 0.0 } else { position.x };
        Point3::new(x, position.y, position.z)
    }

    /// Captures a frame if one is due, and passes arrived frames to the controller.
    fn run_camera(&mut self, now: Micros, t: f64, monitor: &mut Monitor) {
        let due = f64::from(self.frames) * self.camera.period_s() <= t;
        if self.ticks.is_multiple_of(TICKS_PER_STEP) && due {
            let ball = self.plant.ball();
            let measured = self.view.as_ref().map_or(ball, |view| view.measured(t, ball));
            self.camera.observe(t, measured);
            self.frames += 1;
        }
        while let Some(observed) = self.camera.delivered(t) {
            monitor.start_s.get_or_insert(t);
            let age_us = if self.suite.ages_known {
                ((t - observed.captured_at_s) * 1e6) as u32
            } else {
                self.assumed_age_us
            };
            let position = observed.position.map(|position| self.in_plane(position));
            self.controller.on_position(now, age_us, position);
        }
    }
}

/// Map from true to measured positions.
#[derive(Debug, Clone)]
pub(crate) enum View {
    /// The camera's pose is wrong.
    Turned(TurnedFrame),
    /// Two jogs have given the frame.
    Picture(PictureView),
}

impl View {
    /// Returns the measured position of a true one (metres) at a time of the run, seconds.
    fn measured(&self, time_s: f64, point: Point3<f64>) -> Point3<f64> {
        match self {
            Self::Turned(frame) => frame.measured(point),
            Self::Picture(view) => view.measured(time_s, point),
        }
    }

    /// Returns the true position of a measured one, metres.
    fn true_position(&self, point: Point3<f64>) -> Point3<f64> {
        match self {
            Self::Turned(frame) => frame.true_position(point),
            Self::Picture(view) => view.true_position(point),
        }
    }
}

/// A target of a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leg {
    /// The target, metres in the rig frame.
    pub(crate) target: Point3<f64>,
    /// Time that the oracle needs from the target before, seconds.
    pub(crate) oracle_s: f64,
    /// The rig where it is changed before the run to this target.
    pub(crate) changed: Option<Geometry>,
}

impl Leg {
    /// Returns the time limit of the drive to the target, seconds.
    fn limit_s(&self) -> f64 {
        self.oracle_s * TIME_LIMIT_ORACLES + TIME_LIMIT_S
    }
}

/// Returns the plant with the defect of the suite.
fn broken(suite: &Suite, plant: Box<dyn Plant>) -> Box<dyn Plant> {
    match suite.defect {
        Some(defect) => Box::new(Broken::new(plant, defect)),
        None => plant,
    }
}

/// Runs `controller` on a task of `suite`, through these targets, which are measured places of
/// `view`; `None` where all positions are true ones. Returns the outcome of each target. One
/// that was not held ends the run, and those after it have its outcome.
///
/// # Errors
/// If the parameters of the rig or the camera are invalid. A rig that cannot follow its motors is
/// an outcome ([`RunEnd::PlantFailed`]).
pub(crate) fn run(
    controller: &mut dyn Controller,
    suite: &Suite,
    task: &Task,
    id: RunId,
    (legs, view): (&[Leg], Option<View>),
) -> Result<Vec<Outcome>, BenchError> {
    let on_error = BenchError::of_rig(id);
    let camera_seed = id.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ id.rig;
    let camera = CameraMonitor::new(suite.camera, camera_seed).map_err(on_error)?;
    let mut simulation = Simulation {
        plant: broken(suite, suite.plant(task, id).map_err(on_error)?),
        assumed_age_us: (suite.assumed_frames * camera.period_s() * 1e6) as u32,
        view,
        frames: 0,
        ticks: 0,
        motors: [0.0; MOTORS],
        zero: [0.0; MOTORS],
        camera,
        controller,
        suite,
        id,
    };
    let mut outcomes: Vec<Outcome> = Vec::new();
    for (number, leg) in legs.iter().enumerate() {
        let outcome = match outcomes.last() {
            Some(last) if last.end != RunEnd::Held => last.clone(),
            _ => simulation.drive(number, leg),
        };
        outcomes.push(outcome);
    }
    Ok(outcomes)
}
