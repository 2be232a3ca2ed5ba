//! Every goal against every kind of input, and random sequences of inputs.

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};

use nalgebra::{Matrix3, Vector3};
use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::Image;
use plumb_frame::observation::{BallObservation, Circle};
use plumb_path::shape::{Plane, Shape, ShapeKind};
use plumb_path::trajectory::{MotionLimits, Run as Repetition};
use plumb_protocol::message::{State, Telemetry};
use plumb_protocol::units::Micrometres;
use proptest::prelude::*;

use super::*;
use crate::link::Subject;
use crate::operator::{CommandOutcome, OperatorCommand, Stop, StopEvent};
use crate::rig::Rig;
use crate::run::targets::{TargetRules, TargetUse};
use crate::targets::{Arrivals, LeftOut, MotionId, TargetSender, TimedTarget, target_channel};

/// Target of the list.
const TARGET: [f64; 3] = [0.54, 0.22, 0.3];

/// The paper's rig, and a path for it.
static PAPER: LazyLock<(Rig, PathPlan)> = LazyLock::new(|| {
    let rig = Rig::paper().unwrap();
    let plan = circle(&rig);
    (rig, plan)
});

/// A run with an operator, and a board that a test plays.
struct Bench {
    core: RunCore,
    now: f64,
    view: LinkView,
    /// Actions for the board.
    sent: Vec<BoardAction>,
    events: Vec<RunEvent>,
    ending: Option<Result<StopReason, ControlLoopError>>,
    /// Number of the last command of the operator.
    number: u64,
    sender: TargetSender,
    /// Newest motion.
    motion: MotionId,
}

impl Bench {
    /// Returns a run that has begun, along a list of `targets` times the same target.
    fn new(targets: usize, has_path: bool) -> Self {
        let mut bench = Self::before(targets, has_path, TargetUse::Steering);
        bench.step(Input::Begin { is_stopped: false });
        bench
    }

    /// Returns a run that has not begun. With targets that move as its goal it has no operator.
    fn before(targets: usize, has_path: bool, usage: TargetUse) -> Self {
        let (rig, plan) = &*PAPER;
        let rules = rig.motion_rules();
        let waypoints = vec![Waypoint::new(TARGET); targets];
        let route = match targets {
            0 => Route { waypoints: Vec::new(), is_repeated: false },
            _ => Route::new(&waypoints, false, &rules).unwrap(),
        };
        let workspace = rig.config().unwrap().workspace;
        let of_targets =
            TargetRules { motion: rules.clone(), workspace, max_speed: 0.1, radius: 0.01 };
        let is_operated = usage == TargetUse::Steering;
        let settings = Settings { radius: 0.01, rules, timeout: 120.0, is_operated };
        let plan = has_path.then(|| plan.clone());
        let targets = TargetDrive::new(usage, of_targets);
        Self {
            core: RunCore::new(settings, &route, plan, Some(targets)),
            now: 0.0,
            view: LinkView::default(),
            sent: Vec::new(),
            events: Vec::new(),
            ending: None,
            number: 0,
            sender: target_channel().0,
            motion: MotionId::default(),
        }
    }

    fn step(&mut self, input: Input) {
        self.now += 0.01;
        let actions = self.core.step(self.now, input);
        self.ending = actions.ending.or(self.ending.take());
        for action in actions.list {
            match action {
                Action::Event(record) => self.events.push(record.event),
                Action::Record(_) => {}
                Action::EndMotions => {
                    self.core.step(self.now, Input::MotionsEnded(self.motion));
                }
                Action::Board(action) => {
                    self.note_sent(&action);
                    self.sent.push(action);
                }
            }
        }
    }

    /// Changes what the link knows, as it does where it sends something.
    fn note_sent(&mut self, action: &BoardAction) {
        match action {
            BoardAction::Position { .. } => self.view.sequence += 1,
            // Telemetry so far is about another target.
            BoardAction::Target(_) | BoardAction::LeavePath => {
                self.view.subject = Subject::default()
            }
            BoardAction::Follow(_) if !self.view.subject.is_path => {
                self.view.subject = Subject::default();
            }
            _ => {}
        }
    }

    /// Takes a command of the operator. Returns its number.
    fn command(&mut self, command: OperatorCommand) -> u64 {
        self.number += 1;
        self.step(Input::Operator(Submitted { number: self.number, command }));
        self.number
    }

    /// Answers the operator's last command.
    fn answer(&mut self, reply: Reply) {
        let command = self.core.in_flight.map(|submitted| submitted.command);
        if let (Ok(()), Some(OperatorCommand::Target(_) | OperatorCommand::Hold)) = (reply, command)
        {
            self.view.subject = Subject::default();
        }
        self.step(Input::Board { view: self.view, reply: Some(reply) });
    }

    /// Has telemetry of this state come, `about` the target asked for last or not.
    fn telemetry(&mut self, state: State, about: bool) {
        let is_path = about && state == State::Following;
        self.view.subject = Subject { is_destination: about, is_path, is_rest: about };
        self.view.telemetry = Some(Telemetry {
            time: Micros((self.now * 1e6) as u64),
            state,
            configuration: Some(1),
            target: about.then_some(1),
            sequence: Some(self.view.sequence),
            motors: Default::default(),
            rates: Default::default(),
            error: Default::default(),
            filtered_error: Micrometres(1000),
            bad_frames: 0,
            tensions: None,
            reference: None,
        });
        self.step(Input::Board { view: self.view, reply: None });
    }

    /// Takes a picture of the ball at `place`, up to its record.
    fn picture(&mut self, place: [f64; 3]) {
        let intrinsics =
            Intrinsics { fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, depth_scale: 1e3, distortion: None };
        let (colour, depth) = (Image::filled(2, 2, [0; 3]), Image::filled(2, 2, 500));
        let frame = RgbdFrame::new(self.now, colour, depth, intrinsics).unwrap();
        let circle = Circle { u: 0.0, v: 0.0, radius: 1.0, covariance: Matrix3::identity() };
        let position = Gaussian3 { mean: place.into(), covariance: Matrix3::identity() * 1e-6 };
        let ball =
            BallObservation { stamp: self.now, circle, score: 1.0, position: Some(position) };
        let (frame, ball) = (Arc::new(frame), Some(ball));
        self.step(Input::Picture(Picture { frame, ball, error: None }));
        self.step(Input::Board { view: self.view, reply: None });
    }

    /// Ends a round.
    fn tick(&mut self) {
        self.step(Input::Sent(self.view));
        self.step(Input::Tick { is_repeating: false });
    }

    /// Has the ball arrive at the present target.
    fn arrive(&mut self) {
        self.telemetry(State::Holding, true);
        self.picture(self.core.target.into());
        self.tick();
    }

    /// Has the board stop by itself.
    fn fault(&mut self) {
        self.view.fault = Some(Fault::BallOutside.into());
        self.tick();
    }

    /// Has a target of a new motion come, and the ball be seen before.
    fn moving_target(&mut self, is_stopped: bool) {
        self.motion = self.sender.begin();
        self.picture(TARGET);
        self.telemetry(State::Ready, false);
        let target = TimedTarget {
            motion: self.motion,
            time: self.now,
            position: TARGET.into(),
            velocity: Some(Vector3::zeros()),
        };
        let left_out = LeftOut::default();
        let (targets, problems) = (vec![target], Vec::new());
        let arrivals = Arrivals { targets, problems, left_out, has_ended: false };
        self.step(Input::Moving { arrivals, is_stopped });
    }

    /// Has a Resume end a Stop.
    fn resume(&mut self) {
        self.number += 1;
        let stop = Stop { number: 1, by: "a".into(), since: std::time::UNIX_EPOCH, refused: 0 };
        let number = self.number;
        self.step(Input::Stop(StopEvent::Resumed { number, stop, by: "a".into() }));
    }

    /// Returns a run with the goal of this name.
    fn with_goal(name: &str) -> Self {
        let mut bench = match name {
            "waypoint" => Self::new(1, false),
            "path" => Self::new(1, true),
            _ => Self::new(0, false),
        };
        match name {
            "path" => bench.arrive(),
            "moving" => bench.moving_target(false),
            "settling" | "held" => {
                bench.command(OperatorCommand::Hold);
                bench.answer(Ok(()));
                if name == "held" {
                    bench.telemetry(State::Holding, true);
                }
            }
            "jogging" => {
                bench.command(JOG);
                bench.answer(Ok(()));
            }
            "faulted" => bench.fault(),
            _ => {}
        }
        assert_eq!(bench.core.goal.name(), name);
        bench
    }
}

const JOG: OperatorCommand = OperatorCommand::Jog { motor: 0, distance: 5.0, rate: 5.0 };

fn target() -> OperatorCommand {
    OperatorCommand::Target(TARGET.into())
}

/// Returns a circle that the paper's rig allows.
fn circle(rig: &Rig) -> PathPlan {
    let shape = Shape {
        kind: ShapeKind::Circle,
        centre: Point3::new(0.45, 0.30, 0.325),
        size: 0.15,
        plane: Plane::Level,
        tolerance: 0.005,
        seed: 1,
    };
    let trajectory = shape.trajectory(&MotionLimits::with_speed(0.05), Repetition::Once).unwrap();
    PathPlan::new(trajectory, true, rig).unwrap()
}

/// Goals of the table, in the order of its columns.
const GOALS: [&str; 8] =
    ["idle", "waypoint", "path", "moving", "settling", "held", "jogging", "faulted"];

/// Row of the table: an input, and the goals after it, for each goal before it. A `!` means that
/// the run ends.
type Row = (&'static str, fn(&mut Bench), [&'static str; 8]);

/// Returns the table.
fn table() -> Vec<Row> {
    fn send(command: OperatorCommand, reply: Option<Reply>) -> impl Fn(&mut Bench) {
        move |bench| {
            bench.command(command);
            reply.inspect(|reply| bench.answer(*reply));
        }
    }
    vec![
        (
            "a Stop is sent",
            |b| send(OperatorCommand::Stop, None)(b),
            ["idle", "idle", "idle", "idle", "idle", "idle", "idle", "faulted"],
        ),
        (
            "a Stop is accepted",
            |b| send(OperatorCommand::Stop, Some(Ok(())))(b),
            ["idle", "idle", "idle", "idle", "idle", "idle", "idle", "faulted"],
        ),
        (
            "a Hold is sent",
            |b| send(OperatorCommand::Hold, None)(b),
            ["idle", "waypoint", "waypoint", "waypoint", "settling", "held", "jogging", "faulted"],
        ),
        (
            "a Hold is accepted",
            |b| send(OperatorCommand::Hold, Some(Ok(())))(b),
            [
                "settling", "settling", "settling", "settling", "settling", "settling", "settling",
                "settling",
            ],
        ),
        (
            "a Target is sent",
            |b| send(target(), None)(b),
            ["idle", "waypoint", "waypoint", "waypoint", "settling", "held", "jogging", "faulted"],
        ),
        (
            "a Target is accepted",
            |b| send(target(), Some(Ok(())))(b),
            [
                "waypoint", "waypoint", "waypoint", "waypoint", "waypoint", "waypoint", "waypoint",
                "waypoint",
            ],
        ),
        (
            "a jog is accepted",
            |b| send(JOG, Some(Ok(())))(b),
            ["jogging", "waypoint", "path", "moving", "jogging", "jogging", "jogging", "faulted"],
        ),
        (
            "the fault is cleared",
            |b| {
                b.view.fault = None;
                send(OperatorCommand::ClearFault, Some(Ok(())))(b);
            },
            ["idle", "waypoint", "path", "moving", "settling", "held", "jogging", "idle"],
        ),
        (
            "the board stops by itself",
            Bench::fault,
            [
                "faulted", "faulted", "faulted", "faulted", "faulted", "faulted", "faulted",
                "faulted",
            ],
        ),
        (
            "the ball arrives",
            Bench::arrive,
            ["idle", "idle", "idle", "moving", "held", "held", "idle", "faulted"],
        ),
        (
            "time passes",
            |b| {
                b.now += 1000.0;
                b.tick();
            },
            ["idle", "idle", "idle", "moving", "settling", "held", "jogging", "faulted"],
        ),
        (
            "a target moves",
            |b| b.moving_target(false),
            ["moving", "moving", "moving", "moving", "settling", "moving", "moving", "faulted"],
        ),
        (
            "a target moves during a Stop",
            |b| b.moving_target(true),
            ["idle", "waypoint", "path", "waypoint", "settling", "held", "jogging", "faulted"],
        ),
        (
            "a Resume",
            Bench::resume,
            ["idle", "waypoint", "path", "waypoint", "settling", "held", "jogging", "faulted"],
        ),
        (
            "End",
            |b| send(OperatorCommand::End, None)(b),
            ["idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "faulted!"],
        ),
        (
            "an interruption",
            |b| b.step(Input::Interrupt),
            ["idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "faulted!"],
        ),
        (
            "no more frames",
            |b| b.step(Input::EndOfFrames),
            ["idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "idle!", "faulted!"],
        ),
        (
            "a failure",
            |b| b.step(Input::Failed(StopReason::Failed("x".to_owned()))),
            ["idle", "idle", "idle", "idle", "settling", "held", "jogging", "faulted"],
        ),
    ]
}

#[test]
fn every_goal_takes_every_input_as_the_table_has_it() {
    for (name, apply, after) in table() {
        let found = GOALS.map(|goal| {
            let mut bench = Bench::with_goal(goal);
            apply(&mut bench);
            let end = if bench.ending.is_some() { "!" } else { "" };
            format!("{}{end}", bench.core.goal.name())
        });
        assert_eq!(found, after, "{name}");
    }
}

#[test]
fn a_refused_command_changes_nothing_but_its_outcome() {
    use plumb_protocol::message::{Fault, Refusal};
    for goal in ["idle", "waypoint", "settling", "held", "jogging", "faulted"] {
        for command in [target(), OperatorCommand::Hold, JOG, OperatorCommand::ClearFault] {
            let mut bench = Bench::with_goal(goal);
            bench.command(command);
            bench.answer(Err(Refusal::Faulted(Fault::BallOutside)));
            assert_eq!(bench.core.goal.name(), goal, "{command}");
            assert!(matches!(
                bench.events.last(),
                Some(RunEvent::Command { outcome: CommandOutcome::Refused(_), .. })
            ));
        }
    }
}

#[test]
fn a_command_without_an_answer_comes_before_the_next_target() {
    for command in [OperatorCommand::Hold, target()] {
        let mut bench = Bench::new(2, false);
        bench.command(command);
        bench.sent.clear();
        bench.arrive();
        assert!(
            !bench.sent.iter().any(|action| matches!(action, BoardAction::Target(_))),
            "{command}"
        );
        assert_eq!(bench.core.goal.name(), "waypoint");
    }
}

#[test]
fn a_target_that_moved_is_reached_where_the_board_holds_the_ball_at_its_rest() {
    let reached = |is_rest: bool| {
        let mut bench = Bench::before(0, false, TargetUse::Goal);
        bench.step(Input::Begin { is_stopped: false });
        bench.moving_target(false);
        let arrivals = Arrivals { has_ended: true, ..Arrivals::default() };
        bench.step(Input::Moving { arrivals, is_stopped: false });
        bench.telemetry(State::Holding, true);
        bench.view.subject.is_rest = is_rest;
        bench.picture(bench.core.target.into());
        bench.tick();
        matches!(bench.ending, Some(Ok(StopReason::Reached)))
    };
    assert_eq!([reached(false), reached(true)], [false, true]);
}

/// One input of a random sequence.
#[derive(Debug, Clone, Copy)]
enum Op {
    Target,
    Hold,
    Stop,
    Resume,
    Jog,
    ClearFault,
    Answer(bool),
    Telemetry(u8, bool),
    Picture(bool),
    Arrive,
    Lost,
    Moving,
    Fault,
    Tick,
    Wait,
}

fn ops() -> impl Strategy<Value = Vec<Op>> {
    let op = prop_oneof![
        1 => Just(Op::Target),
        1 => Just(Op::Hold),
        1 => Just(Op::Stop),
        1 => Just(Op::Resume),
        1 => Just(Op::Jog),
        1 => Just(Op::ClearFault),
        3 => any::<bool>().prop_map(Op::Answer),
        1 => (0..6u8, any::<bool>()).prop_map(|(state, about)| Op::Telemetry(state, about)),
        1 => any::<bool>().prop_map(Op::Picture),
        3 => Just(Op::Arrive),
        1 => Just(Op::Lost),
        1 => Just(Op::Moving),
        1 => Just(Op::Fault),
        1 => Just(Op::Tick),
        1 => Just(Op::Wait),
    ];
    proptest::collection::vec(op, 1..60)
}

/// A random run, and what must hold for it.
struct Trial {
    bench: Bench,
    is_stopped: bool,
    /// Whether a command has ended the list of targets.
    has_left_list: bool,
    /// Whether the board held the ball at the present target, with a picture of it there.
    was_there: bool,
    /// Leg under way.
    leg: Option<usize>,
}

impl Trial {
    fn apply(&mut self, op: Op) {
        let bench = &mut self.bench;
        // The operator's queue refuses what moves the ball while a Stop holds.
        let moves = matches!(op, Op::Target | Op::Hold | Op::Jog);
        match op {
            _ if moves && self.is_stopped => {}
            Op::Target => drop(bench.command(target())),
            Op::Hold => {
                self.has_left_list = true;
                bench.command(OperatorCommand::Hold);
            }
            Op::Jog => drop(bench.command(JOG)),
            Op::Stop => {
                (self.is_stopped, self.has_left_list) = (true, true);
                bench.command(OperatorCommand::Stop);
            }
            Op::Resume if self.is_stopped => {
                self.is_stopped = false;
                bench.resume();
            }
            Op::Resume => {}
            Op::ClearFault => drop(bench.command(OperatorCommand::ClearFault)),
            Op::Answer(is_accepted) => {
                use plumb_protocol::message::Refusal;
                if is_accepted
                    && bench
                        .core
                        .in_flight
                        .is_some_and(|it| it.command == OperatorCommand::ClearFault)
                {
                    bench.view.fault = None;
                }
                bench.answer(if is_accepted { Ok(()) } else { Err(Refusal::NotStored) });
            }
            Op::Telemetry(state, about) => {
                let states = [
                    State::Ready,
                    State::Seeking,
                    State::Holding,
                    State::Following,
                    State::Jogging,
                    State::Stopping,
                ];
                bench.telemetry(states[usize::from(state)], about);
            }
            Op::Picture(is_near) => {
                let place = if is_near { bench.core.target.into() } else { [0.4, 0.3, 0.5] };
                bench.picture(place);
            }
            Op::Lost => {
                let error = plumb_frame::source::SourceError::new("lost");
                bench.step(Input::FrameLost(error.into()));
            }
            Op::Moving => bench.moving_target(self.is_stopped),
            Op::Fault => bench.view.fault = Some(Fault::BallOutside.into()),
            Op::Arrive => {
                bench.telemetry(State::Holding, true);
                bench.picture(bench.core.target.into());
                self.apply(Op::Tick);
            }
            Op::Tick => {
                let near = bench.core.picture.as_ref().and_then(Picture::position);
                let near = near.is_some_and(|it| (it.mean - bench.core.target).norm() < 0.02);
                let holds = |it: &Telemetry| it.state == State::Holding;
                let about = match bench.core.goal.is_moving() {
                    true => bench.view.about_rest(),
                    false => bench.view.about_target(),
                };
                self.was_there |= near && about.is_some_and(holds);
                bench.tick();
            }
            Op::Wait => bench.now += 1.0,
        }
    }

    /// Checks the events and actions since the last call.
    fn check(&mut self) {
        for event in self.bench.events.drain(..) {
            match event {
                RunEvent::TargetSet { number, .. } => {
                    assert_eq!(self.leg.replace(number), None, "two legs at a time");
                    self.was_there = false;
                }
                RunEvent::TargetEnded { number, reason } => {
                    assert_eq!(self.leg.take(), Some(number), "a leg that was not under way");
                    let is_reached = reason == StopReason::Reached;
                    assert!(!is_reached || self.was_there, "reached, but the ball was not there");
                }
                _ => {}
            }
        }
        assert_eq!(self.leg.is_some(), self.bench.core.goal.drive().is_some());
        for action in self.bench.sent.drain(..) {
            let moves = matches!(action, BoardAction::Target(_) | BoardAction::Follow(_));
            assert!(!moves || !self.is_stopped, "a message moves the ball during a Stop");
            let is_of_list = matches!(action, BoardAction::Target(_));
            assert!(!is_of_list || !self.has_left_list, "the list goes on after its end");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 500,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn random_inputs_break_no_rule(ops in ops(), targets in 0..3usize, has_path: bool) {
        let bench = Bench::new(targets, has_path && targets > 0);
        let (is_stopped, has_left_list, was_there) = (false, false, false);
        let mut trial = Trial { bench, is_stopped, has_left_list, was_there, leg: None };
        trial.check();
        let mut outcomes = BTreeMap::<u64, u32>::new();
        let mut count = |events: &[RunEvent]| {
            for event in events {
                if let RunEvent::Command { number, .. } = event {
                    *outcomes.entry(*number).or_default() += 1;
                }
            }
        };
        for op in ops {
            trial.apply(op);
            count(&trial.bench.events);
            trial.check();
            if trial.bench.ending.is_some() {
                break;
            }
        }
        trial.bench.step(Input::Closed(Vec::new()));
        count(&trial.bench.events);
        let submitted = trial.bench.number;
        prop_assert!(outcomes.keys().copied().eq(1..=submitted), "{:?}", outcomes);
        prop_assert!(outcomes.values().all(|count| *count == 1), "{:?}", outcomes);
    }
}
