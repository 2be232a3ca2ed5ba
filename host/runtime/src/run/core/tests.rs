//! A run that tests play both sides of: camera, operator and board.

mod cases;
mod plausibility;
mod sequences;
mod table;

use std::sync::{Arc, LazyLock};

use nalgebra::{Matrix3, Vector3};
use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::Image;
use plumb_frame::observation::{BallObservation, Circle, TwoDepths};
use plumb_path::shape::{Plane, Shape, ShapeKind};
use plumb_path::trajectory::{MotionLimits, Run as Repetition};
use plumb_protocol::message::{State, Telemetry};
use plumb_protocol::units::Micrometres;

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
    /// Motor positions in telemetry, Q4 steps.
    motors: [i32; 3],
    /// The two depths of the ball in pictures.
    depths: Option<TwoDepths>,
    /// Whether pictures show another ball.
    has_rival: bool,
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
        let settings = Settings {
            radius: 0.01,
            rules,
            timeout: 120.0,
            is_operated,
            ball_speed: BallSpeed { max: f64::INFINITY, motor_rate: 6400.0 },
            following_turn: Steps16(6400),
        };
        let plan = has_path.then(|| plan.clone());
        let targets = TargetDrive::new(usage, of_targets);
        let mut core = RunCore::new(settings, &route, plan, Some(targets));
        core.plausibility.note_answer();
        Self {
            core,
            now: 0.0,
            view: LinkView::default(),
            sent: Vec::new(),
            events: Vec::new(),
            ending: None,
            number: 0,
            sender: target_channel().0,
            motion: MotionId::default(),
            motors: [0; 3],
            depths: None,
            has_rival: false,
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
            motors: self.motors.map(Steps16).into(),
            rates: Default::default(),
            error: Default::default(),
            filtered_error: Micrometres(1000),
            bad_frames: 0,
            tensions: None,
            reference: None,
            late_ticks: 0,
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
        let (stamp, position, depths) = (self.now, Some(position), self.depths);
        let ball = Some(BallObservation { stamp, circle, score: 1.0, position, depths });
        let (frame, rejected, has_rival) = (Arc::new(frame), None, self.has_rival);
        self.step(Input::Picture(Picture { frame, ball, rejected, has_rival, error: None }));
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
        self.picture(self.core.target.unwrap_or_default().into());
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
        let arrivals = Arrivals { targets, problems, left_out, end: None };
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
