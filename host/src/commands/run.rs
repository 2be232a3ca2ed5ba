//! `plumb run`, `plumb goto`, and the run of every command that drives: a board, a camera, targets.

use std::path::Path;
use std::sync::atomic::Ordering;

use clap::Parser;
use plumb_cameras::record::Overflow;
use plumb_cameras::settings::SourceName;
use plumb_config::bounded_read::read_text;
use plumb_config::toml_file::{MAX_BYTES, TomlFileError};
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::rig::check::wrong_targets;
use plumb_runtime::rig::{LawSettings, Rig};
use plumb_runtime::run::{RunError, check_targets};
use plumb_setup::two_jogs::KeptFrame;

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
use crate::session::picture::{self, FrameKeeper, InPicture};
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

/// Drive the ball to one target: metres in the rig frame, or a pixel
///
/// A rig file with [plane] takes a pixel of the picture: column and row.
#[derive(Parser)]
#[command(
    allow_negative_numbers = true,
    after_help = examples![
        "plumb goto 0.4 0.3 0.2",
        "plumb goto --rig trial/rig.toml 0.4 -0.1 0.2 --timeout 30",
        "plumb goto --rig wall/rig.toml 412 233",
    ]
)]
pub(crate) struct GotoArgs {
    /// Along the side from motor C to motors A and B, or the column; -100 to 65535 m or pixels
    #[arg(value_parser = numbers::within(numbers::PLACE))]
    x: f64,
    /// Along the line from motor B to motor A, or the row; -100 to 65535 m or pixels
    #[arg(value_parser = numbers::within(numbers::PLACE))]
    y: f64,
    /// Upwards, -100 to 100 m
    #[arg(value_parser = numbers::within(numbers::COORDINATE))]
    z: Option<f64>,
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
    /// Turn the motors of a rig with [plane] for its two jogs without asking
    #[arg(long)]
    yes: bool,
    #[command(flatten)]
    pub(super) run: RunOptions,
}

impl Common {
    /// Gives the law of the options to `rig`. In a picture it keeps the mean of the rig file.
    fn choose_law(&self, rig: &mut Rig) {
        if let Some(law) = &self.law {
            let mean = rig.law.mean();
            rig.law = law.clone();
            if rig.plane.is_some() {
                rig.law.set_mean(mean);
            }
        }
    }

    /// Returns whether the camera of the rig of `file` is simulated.
    ///
    /// # Errors
    /// Where the options choose the physics of a rig whose camera is real.
    fn is_simulated(&self, file: &Path, rig: &Rig) -> Result<bool, Failure> {
        let is_simulated = chosen_source(file, rig)? == SourceName::Simulated;
        if self.physics.is_some() && !is_simulated {
            let why = "--physics is of a simulated rig, but the camera of this rig file is real";
            return Err(failed(format!("{}: {why}", file.display())));
        }
        Ok(is_simulated)
    }

    /// Opens the port to the board of `rig`.
    fn open_port(&self, rig: &Rig) -> Result<Port, Failure> {
        // The other programs in ROS 2 do not wait.
        Ok(match self.run.ros2.ros2 {
            true => Port::Serial(self.port.open_in_real_time(rig)?),
            false => self.port.open(rig)?,
        })
    }
}

/// Asks for real-time priority, unless the rig is simulated or the board emulated: they share the
/// computer, and must not wait for the control loop.
fn ask_for_real_time(is_simulated: bool, transport: &Port) {
    if !is_simulated && !transport.is_pseudo_terminal() {
        note!("{}", RealTime::ask());
    }
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
    match (&mut rig.plane, args.z) {
        (Some(plane), None) => plane.set(vec![[args.x, args.y]], plane.motors_px())?,
        (None, Some(z)) => {
            rig.set_targets(&[[args.x, args.y, z]])?;
            check_targets(&rig)?;
        }
        (Some(_), Some(_)) => return Err(failed("a rig file with [plane] takes a pixel: u v")),
        (None, None) => return Err(failed("a rig file without [plane] takes a place: x y z")),
    }
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
    if rig.plane.is_some() {
        let goal = goal_in_picture(&rig, goal, options.run.page.page)?;
        return drive_in_picture(file, rig, |_| Ok(goal), options);
    }
    options.choose_law(&mut rig);
    let (camera_text, camera) = read_camera(file, &rig)?;
    if !rig.motion_rules().know_the_motors() {
        tell!("{}: has no [size]: a target that no cables can hold is not refused", file.display());
    }
    goal.tell_target_at_border(&rig);
    let is_simulated = options.is_simulated(file, &rig)?;
    let output_dir = options.run.output_dir("run");
    output_dir.check()?;
    let transport = options.open_port(&rig)?;
    let interrupted = interrupt_flag(true)?;
    let clear = RigBoard { file, rig: &rig, port: &options.port }.command("clear");
    let overflow = Overflow::Drop;
    let task = Task { rig, camera_text, goal, output_dir, overflow, clear };
    let mut session = Session::prepare(task, &camera, &options.run)?;
    ask_for_real_time(is_simulated, &transport);
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

/// Prepares a drive in the picture of a camera of unknown place, as [`drive`]: asks first, connects
/// to the board and opens the camera. The jogs are the beginning of the work. `goal` gets the rig
/// in the frame of the picture.
pub(super) fn drive_in_picture(
    file: &Path,
    mut rig: Rig,
    goal: impl FnOnce(&Rig) -> Result<Goal, Failure> + 'static,
    options: Common,
) -> Result<Work, Failure> {
    options.choose_law(&mut rig);
    let (camera_text, camera) = read_camera(file, &rig)?;
    let is_simulated = options.is_simulated(file, &rig)?;
    let output_dir = options.run.output_dir("run");
    output_dir.check()?;
    let board = RigBoard { file, rig: &rig, port: &options.port };
    let frame_file = KeptFrame::path(file);
    let before = picture::Before::read(&frame_file, board, options.yes)?;
    let transport = options.open_port(&rig)?;
    let interrupted = interrupt_flag(true)?;
    ask_for_real_time(is_simulated, &transport);
    let led = transport.led_port().cloned();
    let mut link = board.configured(transport, false)?;
    let motors = BoardReport::from(&link.status()?).motors;
    let physics = options.physics.unwrap_or(Physics::QuasiStatic);
    let simulated = SimulatedRig { physics, motors, led };
    let mut camera = RunCamera::open_beside_board(board, camera, None, simulated)?;
    let clear = board.command("clear");
    Ok(Box::new(move || {
        if interrupted.load(Ordering::Relaxed) {
            return Err(interrupted_before("run"));
        }
        let seen = (&mut camera, options.run.detector);
        let texts = (&rig, &*camera_text);
        let found = picture::measure(texts, &mut link, seen, before, &interrupted)?;
        let InPicture { rig, camera_text, frame } = found;
        let (goal, overflow) = (goal(&rig)?, Overflow::Drop);
        let task = Task { rig, camera_text, goal, output_dir, overflow, clear };
        let mut session = Session::prepare(task, &camera.camera, &options.run)?;
        let run = session.connect_on(link)?;
        let mut keeper = FrameKeeper::begin(frame_file, frame)?;
        let ended = session.drive(run, camera, Some(&mut keeper), &interrupted)?;
        let kept = keeper.keep();
        let exit = ended.conclude(|summary| Ok(print::json(options.run.json, summary)?))?;
        kept.map_err(Failure::with_result)?;
        Ok(exit)
    }))
}

/// Returns the goal of a run in a picture: its targets, or the present place.
fn goal_in_picture(rig: &Rig, goal: Goal, has_page: bool) -> Result<Goal, Failure> {
    let has_targets = rig.plane.as_ref().is_some_and(|plane| !plane.targets.is_empty());
    match goal {
        Goal::PresentPlace => Ok(goal),
        Goal::Targets if has_targets => Ok(goal),
        Goal::Targets if has_page => Ok(Goal::PresentPlace),
        Goal::Targets => Err(failed(
            "the rig file has no `plane.targets`: click one with `--page`, or `plumb goto U V`",
        )),
        Goal::Waypoints(..) | Goal::Path(_) | Goal::Moving(_) => {
            Err(failed("a rig file with [plane] has no metres"))
        }
    }
}
