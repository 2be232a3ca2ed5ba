//! `plumb bench`: the comparisons.

use std::fs::File;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use plumb_bench::control::{self, BenchError, Clock, ControllerKind, PAPER_GAMMAS, Report, Suite};
use plumb_bench::vision::{self, VisionOptions};
use plumb_cameras::camera_file;
use plumb_cameras::source::CameraSource;
use plumb_cameras::source::tum::TumFolder;
use plumb_runtime::rig::LawSettings;
use plumb_vision::camera::Camera;
use plumb_vision::detect::red::RedDetector;
use plumb_vision::detect::{BallDetector, DetectorKind};
use plumb_vision::frame::RgbdFrame;

use super::print::{Reader, message, tell};
use super::{Failure, OrFail, numbers, print};

#[derive(Subcommand)]
pub(crate) enum Command {
    Control(ControlArgs),
    Vision(VisionArgs),
}

/// How fast the laws are on simulated rigs, through the board's own arithmetic
///
/// Laws: interval, sign, adaptive, taut; their f64_reference in f64 (sign-f64); baselines: broyden
/// (uncalibrated servoing), model-5, model-10, model-20 (inverse kinematics, geometry so many
/// percent wrong); limits: oracle, reference (slack-free). Times are multiples of what an oracle
/// with a perfect model needs. Suites: paper (frames to 10 mm of the paper's task for several γ),
/// quasi-static, yaw, tilt, tilt20, radii, heights, noise, outliers, ages, latency, drift,
/// unilateral, bounce4, bounce3, bounce2, elastic, elastic800, elastic150, edge, high, fine,
/// paper-task.
#[derive(Parser)]
pub(crate) struct ControlArgs {
    /// What to compare on; several with commas, or given more than once
    #[arg(long, default_value = "quasi-static", value_delimiter = ',')]
    suite: Vec<String>,
    /// Law or baseline, likewise [default: the default law]
    #[arg(long, value_parser = controller, value_delimiter = ',')]
    law: Vec<ControllerKind>,
    /// Gain of the law interval, 1/s at 0.471 mm of cable a step
    #[arg(long, default_value_t = 450.0, allow_negative_numbers = true, value_parser = numbers::positive)]
    gamma: f64,
    /// Number of rigs
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    rigs: u64,
    /// Number of the first of them, to look at one again that failed
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u64).range(..=1_000_000_000))]
    first_rig: u64,
    /// Seed of rigs and noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Running mean over the step plan, seconds, instead of each law's own
    #[arg(long, allow_negative_numbers = true, value_parser = numbers::finite)]
    mean: Option<f64>,
    /// When the clock starts: with the first picture's arrival, or 1 to 2 frames earlier, when the
    /// target is told
    #[arg(long, value_enum, default_value = "picture")]
    clock: ClockName,
    /// Draw the share of runs that have arrived over time into this SVG file
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// End with a line of JSON on standard output for each law and suite; endless times are null
    #[arg(long)]
    json: bool,
}

/// When a run's clock starts.
#[derive(Clone, Copy, ValueEnum)]
enum ClockName {
    Picture,
    Target,
}

impl From<ClockName> for Clock {
    fn from(name: ClockName) -> Self {
        match name {
            ClockName::Picture => Self::Picture,
            ClockName::Target => Self::Target,
        }
    }
}

/// How well and how fast the detectors find the ball in scenes from a seed
///
/// Suites: scenes (rendered, and balls in the first background), hard (balls of 60 mm put into the
/// backgrounds with what spoils the view, and the same without a ball), empty (all of both without
/// a ball). Backgrounds have the paper's intrinsics.
#[derive(Parser)]
pub(crate) struct VisionArgs {
    /// Which pictures: scenes, hard or empty
    #[arg(long, default_value = "scenes", value_parser = suite)]
    suite: vision::Suite,
    /// Pictures of each kind of scene
    #[arg(long, default_value_t = 20)]
    frames: usize,
    /// Pictures of each kind of scene without a ball, as many as of the others by default
    #[arg(long)]
    empty: Option<usize>,
    /// Seed of the scenes
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// A TUM RGB-D folder; balls are then also rendered into its pictures. May be given more than
    /// once
    #[arg(long, value_name = "FOLDER")]
    background: Vec<PathBuf>,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

fn suite(name: &str) -> Result<vision::Suite, String> {
    vision::Suite::named(name).ok_or_else(|| "scenes, hard or empty".to_owned())
}

fn controller(name: &str) -> Result<ControllerKind, String> {
    let known = || format!("one of {}", ControllerKind::names().join(", "));
    ControllerKind::named(name).ok_or_else(known)
}

pub(crate) fn main(command: Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Control(args) => bench_control(&args),
        Command::Vision(args) => bench_vision(&args),
    }
}

/// Of the runs that failed, so many are named.
const FAILED_SHOWN: usize = 12;

fn bench_control(args: &ControlArgs) -> Result<ExitCode, Failure> {
    if args.suite == ["paper"] {
        return bench_paper(args.json);
    }
    let suites = suites(args)?;
    let controllers = controllers(args)?;
    // Before the runs, since a file that cannot be written is known at once.
    let svg = args.svg.as_ref().map(|file| create(file)).transpose()?;
    let mut reports = Vec::new();
    'suites: for suite in &suites {
        tell!("{}: {}\n{}", suite.name, suite.about, Report::HEADING);
        for controller in &controllers {
            let report = measure(controller, suite, args)?;
            let line = serde_json::to_string(&report).or_failed()?;
            reports.push(report);
            if args.json && print::results(line)? == Reader::Gone {
                break 'suites;
            }
        }
    }
    if let (Some(mut svg), Some(file)) = (svg, &args.svg) {
        svg.write_all(control::draw_curves(&reports).or_failed()?.as_bytes()).or_failed()?;
        tell!("curves: {}", file.display());
    }
    Ok(ExitCode::SUCCESS)
}

fn create(file: &Path) -> Result<File, Failure> {
    File::create(file).map_err(|error| format!("{}: {error}", file.display())).or_bad_input()
}

/// Runs a controller on a suite and tells people of it.
fn measure(
    controller: &ControllerKind,
    suite: &Suite,
    args: &ControlArgs,
) -> Result<Report, Failure> {
    let terminal = std::io::stderr().is_terminal();
    let mut progress = |done: u64| {
        if terminal {
            message(format_args!("\r{} {done}/{} ", controller.name(), args.rigs));
        }
    };
    let rigs = args.first_rig..args.first_rig + args.rigs;
    let report = match control::run(controller, suite, rigs, args.seed, &mut progress) {
        error @ Err(BenchError::Range(_) | BenchError::Config(_)) => error.or_bad_input(),
        result => result.or_failed(),
    }?;
    tell!("{}{report}", if terminal { "\r\x1b[K" } else { "" });
    if !report.failed.is_empty() {
        let first: Vec<String> =
            report.failed.iter().take(FAILED_SHOWN).map(|(k, why)| format!("{k} {why}")).collect();
        tell!("  failed: {}", first.join(", "));
    }
    if report.resumed > 0 {
        tell!("  saw nothing for half a second, stopped and were sent on: {}", report.resumed);
    }
    Ok(report)
}

/// The suites that were asked for, with the clock that was.
fn suites(args: &ControlArgs) -> Result<Vec<Suite>, Failure> {
    let known = || Suite::all().iter().map(|suite| suite.name).collect::<Vec<_>>().join(", ");
    let named = |name: &String| {
        let unknown = || match name.as_str() {
            "paper" => "the suite `paper` is of another kind: ask for it alone".to_owned(),
            _ => format!("no suite `{name}`: one of paper, {}", known()),
        };
        let suite = Suite::named(name).ok_or_else(unknown);
        suite.map(|suite| Suite { clock: args.clock.into(), ..suite }).or_bad_input()
    };
    args.suite.iter().map(named).collect()
}

/// Who was asked for, with what was said about their parameters.
fn controllers(args: &ControlArgs) -> Result<Vec<ControllerKind>, Failure> {
    let mut controllers = args.law.clone();
    if controllers.is_empty() {
        controllers.push(ControllerKind::Board(LawSettings::default()));
    }
    for law in controllers.iter_mut().filter_map(ControllerKind::settings_mut) {
        law.set_gamma(args.gamma).or_bad_input()?;
        if let Some(mean) = args.mean {
            law.set_mean(mean.into());
        }
    }
    Ok(controllers)
}

fn bench_paper(json: bool) -> Result<ExitCode, Failure> {
    let suite = control::paper(&PAPER_GAMMAS).or_failed()?;
    tell!(
        "law interval on the paper's task, no noise, 30 Hz: frames to 10 mm (the paper: 17 100/γ)"
    );
    for (gamma, frames) in suite.gamma.iter().zip(&suite.frames) {
        tell!(
            "  γ = {gamma:4} /s  {frames:5} frames  γ·frames = {:6.0}",
            gamma * f64::from(*frames)
        );
    }
    if json {
        print::result(serde_json::to_string(&suite).or_failed()?)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Most pixels of all backgrounds, which are kept in memory: 1300 pictures of 640x480, 2 GB.
const MOST_BACKGROUND_PIXELS: usize = 400_000_000;

/// Reads the pictures of the recordings in `folders`.
fn backgrounds(folders: &[PathBuf], camera: &Camera) -> Result<Vec<RgbdFrame>, Failure> {
    let (mut frames, mut pixels) = (Vec::new(), 0);
    for folder in folders {
        let mut source = TumFolder::open(folder, camera.intrinsics).or_bad_input()?;
        while let Some(frame) = source.next_frame().or_bad_input()? {
            pixels += frame.colour().pixels().len();
            if pixels > MOST_BACKGROUND_PIXELS {
                let why = format!(
                    "the backgrounds have more than {MOST_BACKGROUND_PIXELS} pixels; give fewer"
                );
                return Err(format!("{}: {why}", folder.display())).or_bad_input();
            }
            frames.push(frame);
        }
    }
    Ok(frames)
}

fn bench_vision(args: &VisionArgs) -> Result<ExitCode, Failure> {
    let camera = camera_file::paper().or_bad_input()?;
    let recorded = backgrounds(&args.background, &camera)?;
    let empty = args.empty.unwrap_or(args.frames);
    if recorded.is_empty() && args.suite == vision::Suite::Hard {
        return Err("the suite `hard` needs a --background FOLDER").or_bad_input();
    }
    let (suite, frames, seed) = (args.suite, args.frames, args.seed);
    let options = VisionOptions { suite, frames, empty, seed, ..VisionOptions::default() };
    let seen = vision::suite_camera(suite, &camera);
    let mut detectors: [Box<dyn BallDetector>; 2] =
        [DetectorKind::Ball.build(&seen), Box::new(RedDetector::new(&seen, options.radius))];
    let report = vision::compare(&camera, &recorded, &mut detectors, &options, &mut |scene| {
        tell!("{scene}")
    })
    .or_failed()?;
    tell!("{report}");
    if args.json {
        print::result(serde_json::to_string(&report).or_failed()?)?;
    }
    Ok(ExitCode::SUCCESS)
}
