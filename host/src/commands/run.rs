//! `plumb run`, `plumb goto`, and the run of every command that drives: a board, a camera, targets.

use std::path::Path;
use std::sync::atomic::Ordering;

use clap::Parser;
use plumb_cameras::record::Overflow;
use plumb_cameras::settings::SourceName;
use plumb_config::bounded_read::read_text;
use plumb_config::toml_file::{MAX_BYTES, TomlFileError};
use plumb_runtime::rig::check::wrong_targets;
use plumb_runtime::rig::{LawSettings, Rig};
use plumb_runtime::run::{RunError, check_targets};

use crate::cli::choices::{Physics, law};
use crate::cli::exit::{Failure, Work, failed};
use crate::cli::interrupt::{interrupt_flag, interrupted_before};
use crate::cli::port::Port;
use crate::cli::port_args::PortArgs;
use crate::cli::rig_path::RigArg;
use crate::cli::{numbers, print};
use crate::session::camera::{RunCamera, SimulatedRig, chosen_source, read_camera};
use crate::session::connection::RigBoard;
use crate::session::goal::Goal;
use crate::session::options::RunOptions;
use crate::session::real_time::RealTime;
use crate::session::{Session, Task};

/// Drive the ball through the targets of a rig file
///
/// The camera is the one that the rig file names (`camera.source`). It is simulated where the rig
/// file has a [simulation] table and names none: the board, real or emulated, is then tried without
/// a rig, and its motor positions move a simulated one.
#[derive(Parser)]
#[command(after_help = examples![
    "plumb run",
    "plumb run --rig trial/rig.toml --law taut --timeout 60 --json",
    "plumb run --record recordings/one",
])]
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
    let (file, mut rig) = args.rig.read()?;
    rig.set_targets(&[[args.x, args.y, args.z]])?;
    check_targets(&rig)?;
    args.options.port.note(&file, &rig);
    drive(&file, rig, Goal::Targets, args.options)
}

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
    let (camera_text, camera) = read_camera(file, &rig)?;
    if !rig.motion_rules().know_the_motors() {
        tell!("{}: has no [size]: a target that no cables can hold is not refused", file.display());
    }
    goal.tell_target_at_border(&rig);
    let is_simulated = chosen_source(file, &rig)? == SourceName::Simulated;
    if options.physics.is_some() && !is_simulated {
        let why = "--physics is of a simulated rig, but the camera of this rig file is real";
        return Err(failed(format!("{}: {why}", file.display())));
    }
    let output_dir = options.run.output_dir("run");
    output_dir.check()?;
    // The other programs in ROS 2 do not wait.
    let transport = match options.run.ros2.ros2 {
        true => Port::Serial(options.port.open_in_real_time(&rig)?),
        false => options.port.open(&rig)?,
    };
    let interrupted = interrupt_flag(true)?;
    let clear = RigBoard { file, rig: &rig, port: &options.port }.command("clear");
    let overflow = Overflow::Drop;
    let task = Task { rig, camera_text, goal, output_dir, overflow, clear };
    let mut session = Session::prepare(task, &camera, &options.run)?;
    // A simulated rig or board shares the computer, and must not wait for the control loop.
    if !is_simulated && !transport.is_pseudo_terminal() {
        note!("{}", RealTime::ask());
    }
    let led = transport.led_port().cloned();
    let connected = session.connect(transport);
    let board = RigBoard { file, rig: &session.task.rig, port: &options.port };
    let mut run = connected.map_err(|error| match error {
        RunError::Connect(error) => board.explained(error, false),
        error => error.into(),
    })?;
    let motors = run.motors()?;
    let physics = options.physics.unwrap_or(Physics::QuasiStatic);
    let simulated = SimulatedRig { physics, motors, led };
    let camera = RunCamera::open_beside_board(board, camera, session.oni(), simulated)?;
    Ok(Box::new(move || {
        camera.check_ball(&session.task.rig, &motors)?;
        if interrupted.load(Ordering::Relaxed) {
            return Err(interrupted_before("run"));
        }
        let ended = session.drive(run, camera, None, &interrupted)?;
        ended.conclude(|summary| Ok(print::json(options.run.json, summary)?))
    }))
}
