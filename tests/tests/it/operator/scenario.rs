//! A run with an operator that acts after each frame.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_path::shape::{Plane, Shape, ShapeKind};
use plumb_path::trajectory::{MotionLimits, Run as Repetition};
use plumb_protocol::message::State;
use plumb_runtime::observer::{EventRecord, FrameRecord, Observer, RunEvent};
use plumb_runtime::operator::{
    CommandOutcome, OperatorClock, OperatorCommand, OperatorSender, operator_with_clock,
};
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run::{PathPlan, Run, RunParts, StopReason, Summary};
use plumb_sim::simulated::{Timing, VirtualBoard};
use plumb_tests::links::{FixedDetector, TrackingCamera, link};
use plumb_vision::detect::{BallDetector, DetectError};
use plumb_vision::frame::RgbdFrame;
use plumb_vision::observation::BallObservation;

/// Target of the rig file, m.
pub(crate) const FIRST: [f64; 3] = [0.400, 0.400, 0.150];
/// Another target inside the workspace, m.
pub(crate) const SECOND: [f64; 3] = [0.480, 0.300, 0.250];

/// Reads the events so far. Returns the commands to send after frame `number`.
pub(crate) type Operation<'a> = dyn FnMut(u64, &Seen) -> Vec<OperatorCommand> + 'a;

/// What the observers of a run receive.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    pub(crate) frames: Vec<FrameRecord>,
    pub(crate) events: Vec<RunEvent>,
}

impl Seen {
    /// Returns the outcomes of the commands, in order.
    pub(crate) fn outcomes(&self) -> Vec<(OperatorCommand, CommandOutcome)> {
        let outcome = |event: &RunEvent| match event {
            RunEvent::Command { command, outcome, .. } => Some((*command, *outcome)),
            _ => None,
        };
        self.events.iter().filter_map(outcome).collect()
    }

    /// Returns whether leg `leg` has ended for `expected`.
    pub(crate) fn has_ended(&self, leg: usize, expected: &StopReason) -> bool {
        self.events.iter().any(|event| {
            matches!(event, RunEvent::TargetEnded { number, reason }
                if *number == leg && reason == expected)
        })
    }

    /// Returns the number of targets that were set.
    pub(crate) fn targets(&self) -> usize {
        let is_target = |event: &&RunEvent| matches!(event, RunEvent::TargetSet { .. });
        self.events.iter().filter(is_target).count()
    }

    /// Returns the board's state at frame `number`.
    pub(crate) fn state(&self, number: u64) -> State {
        self.frames[number as usize].board.expect("a report").state
    }
}

/// Time of a run, for its operator.
#[derive(Debug, Clone, Default)]
pub(crate) struct RunTime(Arc<AtomicU64>);

impl RunTime {
    /// Sets the time, s.
    pub(crate) fn set(&self, time: f64) {
        self.0.store((time * 1e6) as u64, Ordering::Relaxed);
    }

    /// Returns a clock with this time.
    pub(crate) fn clock(&self) -> OperatorClock {
        let (begin, time) = (Instant::now(), Arc::clone(&self.0));
        Box::new(move || begin + Duration::from_micros(time.load(Ordering::Relaxed)))
    }
}

/// Operator that acts after each frame.
struct Script<'a> {
    time: RunTime,
    seen: Seen,
    sender: OperatorSender,
    operation: &'a mut Operation<'a>,
    /// Frame after which the run is interrupted.
    interrupt_at: u64,
    interrupted: &'a AtomicBool,
    moving: &'static [(u64, [f64; 3])],
}

impl Observer for Script<'_> {
    fn frame(&mut self, record: &FrameRecord) {
        assert!(record.number < 5000, "the operator never ends the run: {:?}", self.seen.events);
        self.time.set(record.time);
        self.seen.frames.push(FrameRecord { frame: None, ..record.clone() });
        self.interrupted.fetch_or(record.number == self.interrupt_at, Ordering::Relaxed);
        for (_, place) in self.moving.iter().filter(|(frame, _)| *frame == record.number) {
            let targets = self.sender.targets();
            targets.send(targets.begin(), Instant::now(), Point3::from(*place), None);
        }
        for command in (self.operation)(record.number, &self.seen) {
            self.sender.send(command).expect("a run that goes on");
        }
    }

    fn event(&mut self, record: &EventRecord) {
        let event = &record.event;
        self.seen.events.push(event.clone());
    }
}

/// Detector that does not find the ball in some frames.
pub(crate) struct Blink {
    detector: FixedDetector,
    frames: u64,
    hidden: std::ops::Range<u64>,
}

impl Blink {
    pub(crate) fn new(detector: FixedDetector, hidden: std::ops::Range<u64>) -> Self {
        Self { detector, frames: 0, hidden }
    }
}

impl BallDetector for Blink {
    fn name(&self) -> &'static str {
        "blink"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        let is_hidden = self.hidden.contains(&self.frames);
        self.frames += 1;
        if is_hidden { Ok(None) } else { self.detector.detect(frame) }
    }
}

/// Circumstances of a run.
pub(crate) struct Scenario {
    /// Name of the link.
    pub(crate) link: &'static str,
    /// Seed of the link's faults.
    pub(crate) seed: u64,
    /// Frames in which the ball is hidden.
    pub(crate) hidden: std::ops::Range<u64>,
    /// Time from a picture to its delivery, s.
    pub(crate) latency: f64,
    /// Longest drive to a target, s.
    pub(crate) timeout: f64,
    /// Frame after which the run is interrupted.
    pub(crate) interrupt_at: u64,
    /// Frames after which a target that moves comes, as that of a program, and its place, m.
    pub(crate) moving: &'static [(u64, [f64; 3])],
}

pub(crate) const IDEAL: Scenario = Scenario {
    link: "ideal",
    seed: 1,
    hidden: 0..0,
    latency: 0.045,
    timeout: 60.0,
    interrupt_at: u64::MAX,
    moving: &[],
};

/// Runs the law `taut` to the first target, with `operation` as operator.
pub(crate) fn run<'a>(scenario: &Scenario, operation: &'a mut Operation<'a>) -> (Summary, Seen) {
    let mut rig = Rig::paper().expect("the paper's rig file");
    rig.law = LawSettings::from(LawName::Taut);
    rig.set_targets(&[FIRST]).expect("a target");
    let wire = (link(scenario.link).wire)(scenario.seed);
    let board = VirtualBoard::paper().expect("the paper's rig").with_wire(wire);
    let camera = camera_file::paper().expect("the paper's camera");
    let timing = Timing { latency: scenario.latency, ..Timing::default() };
    let mut source = TrackingCamera::new(board.rig(), camera.clone(), timing);
    let (detector, hidden) = (FixedDetector(camera), scenario.hidden.clone());
    let time = RunTime::default();
    let (sender, receiver) = operator_with_clock(time.clock());
    let interrupted = AtomicBool::new(false);
    let (interrupt_at, interrupted) = (scenario.interrupt_at, &interrupted);
    let (seen, moving) = (Seen::default(), scenario.moving);
    let mut script = Script { time, seen, sender, operation, interrupt_at, interrupted, moving };
    let run = Run::connect(&rig, board.transport()).expect("a configured board");
    let summary = run.drive(RunParts {
        source: &mut source,
        detector: &mut Blink::new(detector, hidden),
        observers: &mut [&mut script],
        operator: Some(receiver),
        timeout: scenario.timeout,
        interrupted,
    });
    let summary = summary.expect("an unbroken run");
    assert!(script.sender.send(OperatorCommand::Stop).is_err(), "the run has ended");
    (summary, script.seen)
}

/// Returns a circle of 15 cm in the middle of the workspace, at 5 cm/s.
pub(crate) fn circle(rig: &Rig) -> PathPlan {
    let shape = Shape {
        kind: ShapeKind::Circle,
        centre: Point3::new(0.45, 0.30, 0.32),
        size: 0.15,
        plane: Plane::Level,
        tolerance: 0.005,
        seed: 1,
    };
    let trajectory = shape.trajectory(&MotionLimits::with_speed(0.05), Repetition::Once);
    PathPlan::new(trajectory.expect("a circle"), true, rig).expect("a path within the workspace")
}

pub(crate) fn target(metres: [f64; 3]) -> OperatorCommand {
    OperatorCommand::Target(Point3::from(metres))
}

/// Sends each command after its frame.
pub(crate) fn at_frames(
    commands: &[(u64, OperatorCommand)],
) -> impl FnMut(u64, &Seen) -> Vec<OperatorCommand> {
    move |number, _| {
        commands.iter().filter(|(frame, _)| *frame == number).map(|(_, command)| *command).collect()
    }
}
