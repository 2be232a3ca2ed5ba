//! `plumb demo`: the paper's task, closed loop, without any hardware.

mod compare;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use nalgebra::Point3;
use plumb_cameras::camera_file;
use plumb_cameras::capture::{Capture, CaptureLimits};
use plumb_cameras::record::{Overflow, RecordFolder};
use plumb_cameras::tum::TumFolder;
use plumb_frame::source::CameraSource;
use plumb_log::{FigureSettings, LawCurve, OutputDir, RunLog};
use plumb_runtime::link::{Serial, Transport};
use plumb_runtime::observer::Observer;
use plumb_runtime::operator::operator;
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run::{Run, RunParts, Summary};
use plumb_sim::emulator::{EMULATED, EmulatedBoard, serve};
use plumb_sim::simulated::{ServedRig, SimulatedCamera, Timing, VirtualBoard};
use plumb_sim::synthetic::{Background, Material, RenderOptions, Room, SyntheticCamera};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;
use serde::Serialize;

use super::follow::{PathOptions, What};
use super::interrupt::interrupt_flag;
use super::operators::Operators;
use super::options::RunOptions;
use super::outputs::Outputs;
use super::print::{self, note};
use super::run::Goal;
use super::run_camera::record_folder;
use super::viewers::Viewers;
use super::{Failure, Physics, Work, failed, law, numbers};

/// The paper's task, closed loop: rendered frames, OpenCV, a serial port, an emulated board, a
/// simulated rig
///
/// The ball goes from P0 (0.540, 0.220, 0.459) to PT (0.400, 0.400, 0.150) m, or with --follow
/// along a path. The last line of standard output is JSON.
#[derive(Parser)]
#[command(
    after_help = examples![
        "plumb demo",
        "plumb demo --virtual-time --law interval --gamma 100",
        "plumb demo --compare",
        "plumb demo --virtual-time --no-depth",
        "plumb demo --follow eight --upright",
    ]
)]
pub(crate) struct Args {
    /// In virtual time and memory instead of real time and a pseudo-terminal; the same for the same
    /// seed
    #[arg(long, conflicts_with_all = ["page", "foxglove", "ros2"])]
    virtual_time: bool,
    /// Render into the first frame of this TUM RGB-D folder instead of a room
    #[arg(long, value_name = "FOLDER")]
    background: Option<PathBuf>,
    /// Seed of the camera's noise, 0 to 1e15
    #[arg(long, default_value_t = 1, allow_negative_numbers = true, value_parser = numbers::seed())]
    seed: u64,
    /// Control law, with its usual parameters: interval (the paper's), sign, adaptive or taut
    /// [default: taut]
    #[arg(long, value_parser = law)]
    law: Option<LawSettings>,
    /// The law interval with this gain at 0.471 mm of cable a step, above 0, to 7539 1/s; the
    /// paper's is 30
    #[arg(long, allow_negative_numbers = true, value_parser = numbers::within(numbers::GAMMA))]
    gamma: Option<f64>,
    /// Every law in turn, and their errors over time in one figure, laws.svg; a line of JSON for
    /// each run comes at the end
    #[arg(
        long,
        conflicts_with_all = ["law", "gamma", "record", "page", "mcap", "foxglove", "ros2"]
    )]
    compare: bool,
    /// Camera without depth, before a plain wall: the size of the ball's outline gives the distance
    #[arg(long, conflicts_with = "background")]
    no_depth: bool,
    /// Physics of the simulated rig
    #[arg(long, value_enum, default_value = "quasi-static")]
    physics: Physics,
    /// Follow this: circle, line, eight, square, spline, or a file with places
    #[arg(long = "follow", value_name = "WHAT", help_heading = "Path")]
    what: Option<What>,
    #[command(flatten)]
    path: PathOptions,
    #[command(flatten)]
    options: RunOptions,
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

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    if args.compare {
        return compare::prepare(args);
    }
    let law = chosen(&args)?;
    let mut curve = LawCurve::new(law.title());
    let demo = Demo::prepare(&args, law, args.options.output_dir("demo"))?;
    Ok(Box::new(move || {
        let interrupted = interrupt_flag(true)?;
        demo.drive(&args, &interrupted, (&mut curve, &mut |line| print::result(line)))
    }))
}

/// Returns the law of the options.
fn chosen(args: &Args) -> Result<LawSettings, Failure> {
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
type Lines<'a> = &'a mut dyn FnMut(&str) -> Result<(), Failure>;

/// A run that is prepared.
struct Demo {
    rig: Rig,
    camera: Camera,
    background: Background,
    goal: Goal,
    overflow: Overflow,
    folder: Option<RecordFolder>,
    viewers: Viewers,
    steering: Operators,
    output_dir: OutputDir,
}

impl Demo {
    /// Prepares a run with `law` into `output_dir`.
    fn prepare(args: &Args, law: LawSettings, output_dir: OutputDir) -> Result<Self, Failure> {
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
        let overflow = if args.virtual_time { Overflow::Block } else { Overflow::Drop };
        let folder = record_folder(args.options.record.as_deref())?;
        output_dir.check()?;
        let viewers = args.options.viewers.start(&rig, &camera, overflow)?;
        let steering = Operators::start(&args.options, &rig, &camera, operator())?;
        Ok(Self { rig, camera, background, goal, overflow, folder, viewers, steering, output_dir })
    }

    /// Runs, adds the errors to the curve, and gives the line of JSON to `Lines`.
    fn drive(
        self,
        args: &Args,
        interrupted: &AtomicBool,
        results: (&mut LawCurve, Lines<'_>),
    ) -> Result<ExitCode, Failure> {
        // In virtual time no message comes before the result, which a stopped terminal (Ctrl-S)
        // must not hold back.
        if !args.virtual_time {
            note!("preparing the simulated camera");
        }
        let (camera, background) = (self.camera.clone(), self.background.clone());
        let synthetic =
            SyntheticCamera::new(camera, background, RenderOptions::default(), args.seed)?;
        let Some(simulation) = self.rig.simulation.clone() else {
            return Err(failed("the paper's rig is not simulated"));
        };
        let motors = simulation.motors();
        let plant = args.physics.plant(&self.rig, &simulation)?;
        let asked = (args, interrupted);
        if args.virtual_time {
            let board = VirtualBoard::new(plant);
            let mut source =
                SimulatedCamera::new(board.rig(), synthetic, motors, Timing::default());
            let ball = || board.board().borrow().ball();
            self.run(asked, &mut source, board.transport(), ball, results)
        } else {
            let served = Arc::new(serve(EmulatedBoard::with_plant(EMULATED, plant))?);
            let port = served.path().to_string_lossy().into_owned();
            note!("emulated board on {port}");
            let transport = Serial::open(&port, self.rig.board.baud)?;
            let Some(simulated) = ServedRig::new(Arc::clone(&served)) else {
                return Err(failed("the board moves no rig"));
            };
            let source = SimulatedCamera::new(simulated, synthetic, motors, Timing::default());
            let mut source = Capture::start(source, CaptureLimits::default())?;
            self.run(asked, &mut source, transport, || served.board().ball(), results)
        }
    }

    /// Runs with the board at `transport`. `ball` returns the true position of the ball, metres in
    /// the rig frame.
    fn run<T: Transport>(
        self,
        (args, interrupted): (&Args, &AtomicBool),
        source: &mut dyn CameraSource,
        transport: T,
        ball: impl Fn() -> Option<Point3<f64>>,
        (curve, lines): (&mut LawCurve, Lines<'_>),
    ) -> Result<ExitCode, Failure> {
        let Self { rig, camera, overflow, mut steering, .. } = self;
        let recorder = self
            .folder
            .map(|folder| folder.begin(camera_file::PAPER, &camera.intrinsics, overflow))
            .transpose()?;
        let (is_operated, operator) = (steering.is_operated(), steering.take_operator());
        let mut run = Run::connect(&rig, transport)?;
        self.goal.set(&mut run)?;
        let log = RunLog::create(&self.output_dir, FigureSettings::of(&rig))?;
        let targets = run.target_count();
        let mut outputs =
            Outputs::start(log, recorder, self.viewers, overflow, targets, is_operated)?;
        let mut observers: Vec<&mut dyn Observer> = vec![&mut outputs, curve];
        observers.extend(steering.observers(source.clock()));
        let result = run.drive(RunParts {
            source,
            detector: &mut *args.options.detector.detector(&camera),
            observers: &mut observers,
            operator,
            timeout: args.options.timeout,
            interrupted,
        });
        let (page, folder) = (steering.take_page(), outputs.folder().to_owned());
        drop(steering);
        let ball = ball().unwrap_or_default();
        outputs.conclude(result, false, |summary| {
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
            if let Some(page) = page {
                page.finish(&folder);
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
