//! A run of the demo: its options, the simulated rig and camera, the line of JSON.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_cameras::record::Overflow;
use plumb_cameras::tum::TumFolder;
use plumb_frame::source::CameraSource;
use plumb_log::{LawCurve, OutputDir};
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run::Summary;
use plumb_sim::simulated::{SimulatedCamera, Timing, VirtualBoard};
use plumb_sim::synthetic::{Background, Material, RenderOptions, Room, SyntheticCamera};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;
use serde::Serialize;

use crate::cli::choices::{Physics, law};
use crate::cli::exit::{Exit, Failure, failed};
use crate::cli::numbers;
use crate::commands::follow::{PathOptions, What};
use crate::session::camera::RunCamera;
use crate::session::goal::Goal;
use crate::session::options::RunOptions;
use crate::session::{Session, Task};

/// The paper's task, closed loop: rendered frames, OpenCV, an emulated board, a simulated rig
///
/// The ball goes from P0 (0.540, 0.220, 0.459) to PT (0.400, 0.400, 0.150) m, or with --follow
/// along a path. The last line of standard output is JSON.
#[derive(Parser)]
#[command(after_help = examples![
    "plumb demo",
    "plumb demo --virtual-time --law interval --gamma 100",
    "plumb demo --compare",
    "plumb demo --planar --page",
    "plumb demo --virtual-time --no-depth",
    "plumb demo --follow eight --upright",
])]
pub(crate) struct Args {
    /// As quick as the computer is, instead of in real time at most; the same for the same seed
    #[arg(long, conflicts_with_all = ["page", "foxglove", "ros2"])]
    pub(super) virtual_time: bool,
    /// Render into the first frame of this TUM RGB-D folder instead of a room
    #[arg(long, value_name = "FOLDER")]
    background: Option<PathBuf>,
    /// Seed of the camera's noise, 0 to 1e15
    #[arg(long, default_value_t = 1, allow_negative_numbers = true, value_parser = numbers::seed())]
    pub(super) seed: u64,
    /// Control law, with its usual parameters: interval (the paper's), sign, adaptive or taut
    /// [default: taut]
    #[arg(long, value_parser = law)]
    pub(super) law: Option<LawSettings>,
    /// The law interval with this gain at 0.471 mm of cable a step, above 0, to 7539 1/s; the
    /// paper's is 30
    #[arg(long, allow_negative_numbers = true, value_parser = numbers::within(numbers::GAMMA))]
    gamma: Option<f64>,
    /// Two motors, both wired the wrong way, before a tilted camera whose picture is mirrored: two
    /// jogs, and the ball goes to a pixel
    #[arg(long)]
    #[arg(conflicts_with_all = ["compare", "gamma", "background", "no_depth", "what"])]
    pub(super) planar: bool,
    /// Every law in turn, and their errors over time in one figure, laws.svg; a line of JSON for
    /// each run comes at the end
    #[arg(long)]
    #[arg(conflicts_with_all = ["law", "gamma", "record", "page", "mcap", "foxglove", "ros2"])]
    pub(super) compare: bool,
    /// Camera without depth, before a plain wall: the size of the ball's outline gives the distance
    #[arg(long, conflicts_with = "background")]
    no_depth: bool,
    /// Physics of the simulated rig
    #[arg(long, value_enum, default_value = "quasi-static")]
    pub(super) physics: Physics,
    /// Follow this: circle, line, eight, square, spline, or a file with places
    #[arg(long = "follow", value_name = "WHAT", help_heading = "Path")]
    what: Option<What>,
    #[command(flatten)]
    path: PathOptions,
    #[command(flatten)]
    pub(super) options: RunOptions,
}

/// Line of JSON: the summary, and the true error of the simulation.
#[derive(Serialize)]
struct Line<'a> {
    #[serde(flatten)]
    summary: &'a Summary,
    /// Distance of the simulated ball from its target at the end, millimetres.
    true_error_mm: f64,
    seed: u64,
    time: &'static str,
}

/// Returns the law of the options.
pub(super) fn chosen(args: &Args) -> Result<LawSettings, Failure> {
    let Some(gamma) = args.gamma else { return Ok(args.law.clone().unwrap_or_default()) };
    let mut law = args.law.clone().unwrap_or_else(|| LawName::Interval.into());
    if !law.set_gamma(gamma)? {
        return Err(failed(format!(
            "--gamma is the gain of the law interval, and the law {} has none: leave --gamma out, \
             or choose --law interval",
            law.name()
        )));
    }
    Ok(law)
}

/// Returns what the ball of the demo follows.
fn goal(args: &Args, rig: &Rig) -> Result<Goal, Failure> {
    let Some(what) = &args.what else { return Ok(Goal::Targets) };
    match args.path.goal(what, rig, false)? {
        Goal::Moving(_) => Err(failed("the demo follows no target that moves")),
        goal => Ok(goal),
    }
}

/// Receiver of a run's line of JSON.
pub(super) type Lines<'a> = &'a mut dyn FnMut(&str) -> Result<(), Failure>;

/// A run that is prepared.
pub(super) struct Demo {
    camera: Camera,
    background: Background,
    session: Session,
}

impl Demo {
    /// Prepares a run with `law` into `output_dir`.
    pub(super) fn prepare(
        args: &Args,
        law: LawSettings,
        output_dir: OutputDir,
    ) -> Result<Self, Failure> {
        let rig = Rig { law, ..Rig::paper()? };
        rig.config()?;
        let mut camera = camera_file::paper()?;
        if args.no_depth {
            camera.intrinsics.depth_scale = 0.0;
        }
        let plain = || Room::bare(Material::from_srgb(140, 150, 120));
        let background = match &args.background {
            None if args.no_depth => Background::Room(plain()),
            None => Background::Room(Room::furnished()),
            Some(folder) => Background::Frame(first_frame(folder, &camera)?),
        };
        let goal = goal(args, &rig)?;
        let task = Task {
            rig,
            camera_text: camera_file::PAPER.to_owned(),
            goal,
            output_dir,
            overflow: if args.virtual_time { Overflow::Block } else { Overflow::Drop },
            clear: "plumb clear".to_owned(),
        };
        let session = Session::prepare(task, &camera, &args.options)?;
        Ok(Self { camera, background, session })
    }

    /// Runs, adds the errors to the curve, and gives the line of JSON to `Lines`.
    pub(super) fn drive(
        self,
        args: &Args,
        interrupted: &AtomicBool,
        (curve, lines): (&mut LawCurve, Lines<'_>),
    ) -> Result<Exit, Failure> {
        // In virtual time no message comes before the result, which a stopped terminal (Ctrl-S)
        // must not hold back.
        if !args.virtual_time {
            note!("preparing the simulated camera");
        }
        let Self { camera, background, mut session } = self;
        let rig = &session.task.rig;
        let options = RenderOptions::default();
        let synthetic = SyntheticCamera::new(camera.clone(), background, options, args.seed)?;
        let Some(simulation) = &rig.simulation else {
            return Err(failed("the paper's rig is not simulated"));
        };
        let motors = simulation.motors();
        let plant = args.physics.plant(rig, simulation)?;
        let board = VirtualBoard::new(plant);
        let rig = if args.virtual_time { board.rig() } else { board.paced_rig() };
        let source = SimulatedCamera::new(rig, synthetic, motors, Timing::default());
        let is_paced = !args.virtual_time;
        let camera = RunCamera { is_paced, ..RunCamera::of(Box::new(source), camera) };
        let run = session.connect(board.transport())?;
        let ended = session.drive(run, camera, Some(curve), interrupted)?;
        let ball = board.board().borrow().ball().unwrap_or_default();
        ended.conclude(|summary| {
            // An operator may have set other targets than the rig file.
            let target = summary.legs.last().map_or_else(Point3::origin, |leg| leg.target_m.into());
            let true_error_mm = ((ball - target).norm() * 1e6).round() / 1e3;
            let time = if args.virtual_time { "virtual" } else { "real" };
            let line = Line { summary, true_error_mm, seed: args.seed, time };
            lines(&serde_json::to_string(&line)?)?;
            if summary.ending.fault().is_some() {
                note!(
                    "the emulated board ends with the demo: there is no fault to clear; run \
                     `plumb demo` again"
                );
            }
            Ok(())
        })
    }
}

fn first_frame(folder: &std::path::Path, camera: &Camera) -> Result<RgbdFrame, Failure> {
    let mut recording = TumFolder::open(folder, camera.intrinsics).map_err(|error| {
        Failure::from(error).with_advice(
            "A background is the folder of a recording, with rgb.txt, depth.txt and their pictures",
        )
    })?;
    let frame = recording.next_frame()?;
    frame.ok_or_else(|| failed(format!("{}: no frame in this recording", folder.display())))
}
