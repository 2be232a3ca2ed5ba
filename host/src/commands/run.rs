//! `plumb run`, `plumb goto`, and the run of every command that drives: a board, a camera, targets.

use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Parser;
use plumb_cameras::record::{Overflow, RecordFolder};
use plumb_cameras::settings::SourceName;
use plumb_config::bounded_read::read_text;
use plumb_config::toml_file::{MAX_BYTES, TomlFileError};
use plumb_log::{FigureSettings, RunLog};
use plumb_runtime::link::{Serial, Transport};
use plumb_runtime::observer::Observer;
use plumb_runtime::operator::operator;
use plumb_runtime::rig::check::wrong_targets;
use plumb_runtime::rig::{LawSettings, Rig};
use plumb_runtime::run::{PathPlan, Run, RunError, RunParts, TargetUse, Waypoint, check_targets};
use plumb_runtime::targets::{TargetOrigin, TargetSender, TargetStream};
use plumb_vision::detect::BallDetector;

use super::connection::{explained, without_simulation};
use super::find_ball::find_ball;
use super::interrupt::{interrupt_flag, interrupted_before};
use super::operators::Operators;
use super::options::RunOptions;
use super::outputs::Outputs;
use super::print::{self, note, tell};
use super::real_time::RealTime;
use super::rig_args::PortArgs;
use super::rig_path::{RigArg, rig_option};
use super::run_camera::{RunCamera, read_camera, record_folder};
use super::{Failure, Physics, Work, detector, failed, law, numbers};

/// Drive the ball through the targets of a rig file
///
/// The camera is the one that the rig file names (`camera.source`). It is simulated where the rig
/// file has a [simulation] table and names none: the board, real or emulated, is then tried without
/// a rig, and its motor positions move a simulated one.
#[derive(Parser)]
#[command(
    after_help = examples![
        "plumb run",
        "plumb run --rig trial/rig.toml --law taut --timeout 60 --json",
        "plumb run --record recordings/one",
    ]
)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    rig: RigArg,
    #[command(flatten)]
    options: Common,
}

/// Drive the ball to one target, metres in the rig frame
#[derive(Parser)]
#[command(
    allow_negative_numbers = true,
    after_help = examples![
        "plumb goto 0.4 0.3 0.2",
        "plumb goto --rig trial/rig.toml 0.4 -0.1 0.2 --timeout 30",
    ]
)]
pub(crate) struct GotoArgs {
    /// Along the side from motor C to motors A and B, -100 to 100 m
    #[arg(value_parser = numbers::within(numbers::COORDINATE))]
    x: f64,
    /// Along the line from motor B to motor A, -100 to 100 m
    #[arg(value_parser = numbers::within(numbers::COORDINATE))]
    y: f64,
    /// Upwards, -100 to 100 m
    #[arg(value_parser = numbers::within(numbers::COORDINATE))]
    z: f64,
    #[command(flatten)]
    rig: RigArg,
    #[command(flatten)]
    options: Common,
}

#[derive(Parser)]
pub(super) struct Common {
    #[command(flatten)]
    pub(super) port: PortArgs,
    /// Control law, with its usual parameters: interval, sign, adaptive or taut [default: the rig
    /// file's]
    #[arg(long, value_parser = law)]
    law: Option<LawSettings>,
    /// Physics of the simulated rig, where the camera is simulated [default: quasi-static]
    #[arg(long, value_enum)]
    physics: Option<Physics>,
    #[command(flatten)]
    pub(super) run: RunOptions,
}

pub(crate) fn run(args: RunArgs) -> Result<Work, Failure> {
    let file = args.rig.needed()?;
    let text = read_text(&file, MAX_BYTES).map_err(TomlFileError::from)?;
    let rig = Rig::parse(&file, &text)?;
    if let Some(finding) = wrong_targets(&file, &text, &rig).first() {
        return Err(failed(finding));
    }
    args.options.port.note(&file, &rig);
    drive(&file, rig, Goal::Targets, args.options)
}

pub(crate) fn goto(args: GotoArgs) -> Result<Work, Failure> {
    let file = args.rig.needed()?;
    let mut rig = Rig::read(&file)?;
    rig.set_targets(&[[args.x, args.y, args.z]])?;
    check_targets(&rig)?;
    args.options.port.note(&file, &rig);
    drive(&file, rig, Goal::Targets, args.options)
}

/// Goal of a run.
pub(super) enum Goal {
    /// The targets of the rig file.
    Targets,
    /// These waypoints; repeated where the flag is set.
    Waypoints(Vec<Waypoint>, bool),
    /// This path.
    Path(Box<PathPlan>),
    /// Targets that move.
    Moving(TargetOrigin),
    /// The place where the ball is, until the run is interrupted.
    PresentPlace,
}

/// Time to an answer of the board from which on a user is told. With 0.4 s the paper's task takes
/// 2.5 times as long as with 0.06 s, with 0.2 s 1.1 times (`plumb emulate --latency`, half of it).
const SLOW_ANSWER: Duration = Duration::from_millis(300);

/// Prepares a drive to `goal` with the rig of `file`: connects to the board, and opens the camera.
pub(super) fn drive(
    file: &Path,
    mut rig: Rig,
    goal: Goal,
    options: Common,
) -> Result<Work, Failure> {
    if let Some(law) = &options.law {
        rig.law = law.clone();
    }
    let (text, camera) = read_camera(file, &rig)?;
    if !rig.motion_rules().know_the_motors() {
        tell!("{}: has no [size]: a target that no cables can hold is not refused", file.display());
    }
    tell_targets_at_border(&goal, &rig);
    let chosen = source_name(file, &rig, &options)?;
    let output_dir = options.run.output_dir("run");
    output_dir.check()?;
    let (sender, mut receiver) = operator();
    let stream = goal.stream(&rig, sender.targets().clone())?;
    let transport = options.port.open(&rig)?;
    let folder = record_folder(options.run.record.as_deref())?;
    let oni = folder.as_ref().map(|folder| folder.oni());
    let interrupted = interrupt_flag(true)?;
    let viewers = options.run.viewers.start(&rig, &camera, Overflow::Drop)?;
    let moving = stream.as_ref().and_then(|_| receiver.take_targets());
    let steering = Operators::start(&options.run, &rig, &camera, (sender, receiver))?;
    // A simulated rig or board shares the computer, and must not wait for the control loop.
    if chosen != SourceName::Simulated && !transport.is_pseudo_terminal() {
        note!("{}", RealTime::ask());
    }
    let connected = Run::connect(&rig, transport);
    let mut run = connected.map_err(|error| match error {
        RunError::Connect(error) => explained(error, file, &options.port, false),
        error => error.into(),
    })?;
    tell_slow_link(&run);
    if let Some(targets) = moving {
        run.set_targets(Box::new(targets), TargetUse::Goal);
    }
    if let Some(fault) = run.cleared_fault() {
        tell!("an earlier run left the board in a fault, cleared: {fault}");
    }
    goal.set(&mut run)?;
    let motors = run.motors()?;
    let mut camera = match chosen {
        SourceName::Simulated => {
            let physics = options.physics.unwrap_or(Physics::QuasiStatic);
            RunCamera::simulated(&rig, camera, physics, motors)?
        }
        _ => {
            let advice = without_simulation(file, &rig, &options.port);
            RunCamera::open(&rig, camera, oni, advice.as_deref())?
        }
    };
    let clear = format!("plumb clear{}{}", rig_option(file), options.port);
    Ok(Box::new(move || {
        camera.check_ball(&rig, motors)?;
        let intrinsics = &camera.camera.intrinsics;
        if interrupted.load(Ordering::Relaxed) {
            return Err(interrupted_before("run"));
        }
        let recorder = folder.map(|folder| folder.begin(&text, intrinsics, Overflow::Drop));
        let recorder = recorder.transpose()?;
        let mut detector = detector(options.run.detector, &camera.camera);
        if let Goal::PresentPlace = goal {
            let target = find_ball(&mut *camera.source, &mut *detector, &interrupted)?;
            let waypoint = Waypoint { dwell_s: f64::INFINITY, ..Waypoint::new(target) };
            let held = run.set_waypoints(&[waypoint], false).map_err(Failure::from);
            held.map_err(|failure| {
                failure.with_advice(
                    "The ball is there now: jog it back into the workspace, `plumb jog`",
                )
            })?;
        }
        let log = RunLog::create(&output_dir, FigureSettings::of(&rig))?;
        let (targets, is_operated) = (run.target_count(), steering.is_operated());
        let outputs = Outputs::start(log, recorder, viewers, Overflow::Drop, targets, is_operated)?;
        let outputs = outputs.cleared_by(clear);
        let is_endless = goal.is_endless();
        PreparedRun { run, camera, detector, steering, stream, outputs, is_endless }
            .drive(&options.run, &interrupted)
    }))
}

/// Says that the board answers late, where it does.
fn tell_slow_link(run: &Run<Serial>) {
    if let Some(time) = run.answer_time().filter(|time| *time >= SLOW_ANSWER) {
        tell!(
            "the link to the board is slow: an answer takes {:.1} s. The ball may swing, or be \
             driven away from its target",
            time.as_secs_f64()
        );
    }
}

/// Names the first target that is nearer to the border of the workspace than the ball is held: the
/// board stops where the ball crosses it.
fn tell_targets_at_border(goal: &Goal, rig: &Rig) {
    let targets: Vec<[f64; 3]> = match goal {
        Goal::Targets => rig.target_places().collect(),
        Goal::Waypoints(waypoints, _) => waypoints.iter().map(|it| it.target).collect(),
        Goal::Path(_) | Goal::Moving(_) | Goal::PresentPlace => return,
    };
    if let Some(target) = rig.target_at_border(targets) {
        tell!("target {} is {target}", target.number);
    }
}

/// A run whose board, camera and outputs are open.
struct PreparedRun {
    run: Run<Serial>,
    camera: RunCamera,
    detector: Box<dyn BallDetector>,
    steering: Operators,
    /// Thread that reads targets.
    stream: Option<TargetStream>,
    outputs: Outputs,
    /// Whether the run goes on until somebody ends it.
    is_endless: bool,
}

impl Goal {
    /// Returns whether a run with this goal goes on until somebody ends it.
    fn is_endless(&self) -> bool {
        match self {
            Self::PresentPlace | Self::Waypoints(_, true) => true,
            Self::Path(plan) => plan.trajectory().is_loop(),
            Self::Targets | Self::Waypoints(_, false) | Self::Moving(_) => false,
        }
    }

    /// Gives waypoints or a path to `run`; it has the other goals from elsewhere.
    pub(super) fn set<T: Transport>(&self, run: &mut Run<T>) -> Result<(), RunError> {
        match self {
            Self::Waypoints(waypoints, is_repeated) => run.set_waypoints(waypoints, *is_repeated),
            Self::Path(plan) => run.set_path((**plan).clone()),
            Self::Targets | Self::PresentPlace | Self::Moving(_) => Ok(()),
        }
    }

    /// Starts to read the targets that move, where these are the goal.
    fn stream(&self, rig: &Rig, sender: TargetSender) -> Result<Option<TargetStream>, Failure> {
        let Self::Moving(origin) = self else { return Ok(None) };
        if let TargetOrigin::Program(address) = origin {
            if rig.camera.stream.as_ref() == Some(address) {
                let why = "`camera.stream` of the rig file is the same; give one of them a socket";
                return Err(failed(format!("targets from {address}: {why}")));
            }
            note!("targets: from {address}");
        }
        Ok(Some(TargetStream::start(origin.clone(), sender)?))
    }
}

impl PreparedRun {
    /// Drives, closes the outputs and prints the result.
    fn drive(self, options: &RunOptions, interrupted: &AtomicBool) -> Result<ExitCode, Failure> {
        let Self { run, camera, mut detector, mut steering, stream, mut outputs, is_endless } =
            self;
        let RunCamera { mut source, mut follower, oni, .. } = camera;
        let operator = steering.take_operator();
        let mut observers: Vec<&mut dyn Observer> = vec![&mut outputs];
        observers.extend(follower.as_mut().map(|follower| follower as &mut dyn Observer));
        observers.extend(steering.observers(source.clock()));
        let result = run.drive(RunParts {
            source: &mut *source,
            detector: &mut *detector,
            observers: &mut observers,
            operator,
            timeout: options.timeout,
            interrupted,
        });
        let (page, folder) = (steering.take_page(), outputs.folder().to_owned());
        drop((steering, stream));
        // A device ends its own recording.
        drop(source);
        if let Some(oni) = &oni
            && let Err(error) = RecordFolder::check_oni(oni)
        {
            tell!("plumb: {}: {error}; use the pictures beside it", oni.display());
        }
        outputs.conclude(result, is_endless, |summary| {
            if options.json {
                print::result(serde_json::to_string(summary)?)?;
            }
            if let Some(page) = page {
                page.finish(&folder);
            }
            Ok(())
        })
    }
}

/// Returns the source of the frames that `rig` of `file` chooses.
fn source_name(file: &Path, rig: &Rig, options: &Common) -> Result<SourceName, Failure> {
    let chosen = rig.camera.source(rig.simulation.is_some());
    let chosen = chosen.map_err(|error| failed(format!("{}: {error}", file.display())))?;
    if options.physics.is_some() && chosen != SourceName::Simulated {
        let why = "--physics is of a simulated rig, but the camera of this rig file is real";
        return Err(failed(format!("{}: {why}", file.display())));
    }
    Ok(chosen)
}
