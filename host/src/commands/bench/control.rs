//! `plumb bench control`: speed of the laws on simulated rigs.

use std::fs::{self, File};
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;
use std::time::Instant;

use clap::{Parser, ValueEnum};
use plumb_bench::UnknownName;
use plumb_bench::control::{
    self, BenchError, Clock, ControllerKind, PAPER_GAMMAS, PathReport, PathSuite, Report, Suite,
    SuiteName,
};
use plumb_config::error_chain::ErrorChain;
use plumb_runtime::rig::LawSettings;
use plumb_runtime::rig::quantity::Mean;

use crate::commands::old_file::check_svg;
use crate::commands::print::{self, Reader, tell};
use crate::commands::progress::{ProgressLine, is_shown};
use crate::commands::{Failure, bad_input, failed, failed_because, numbers};

/// Gain γ of the law interval in the benchmarks, 1/s: fast without oscillation at 30 Hz.
const DEFAULT_GAMMA: f64 = 450.0;

/// Number of rigs of a suite.
const DEFAULT_RIGS: u64 = 300;

/// Seed of rigs and noise.
const DEFAULT_SEED: u64 = 1;

/// Speed of the laws on simulated rigs, with the board's own arithmetic
///
/// Laws: interval, sign, adaptive, taut; their references in f64 (sign-f64); baselines: broyden
/// (uncalibrated servoing), model-5, model-10, model-20 (inverse kinematics, with that error of
/// the geometry in percent); limits: oracle, reference (slack-free). Times are multiples of the
/// time of an oracle with a perfect model. Suites: paper (frames to 10 mm of the paper's task for
/// several γ), quasi-static, yaw, tilt, tilt20, radii, heights, noise, outliers, ages, latency,
/// drift, unilateral, bounce4, bounce3, bounce2, elastic, elastic800, elastic150, stiff, warm800,
/// warm150, warm-moved, warm-pulleys (each further target is a run of its own), edge, high, fine,
/// frame5, frame10, frame20 (positions turned about the target), calibrated-board,
/// calibrated-motors, calibrated-ball (the camera's pose by that way of `plumb calibrate`),
/// paper-task. The ball follows paths at 2, 5, 10 and 20 cm/s: path (rigid cables), path-elastic;
/// with the laws, broyden, the models and oracle.
///
/// Columns of a suite with targets: converged (share of the runs in which the ball arrived and
/// stayed), median, p90, p99 and max (time to the target over the oracle's), slack (share of the
/// runs with a cable slack for more than 20 ms), hold (mean distance from the target afterwards,
/// and its 99th percentile), false (share of the runs that told "reached" with the ball elsewhere),
/// median s (time to the target), lost s (that time less the oracle's: its median and 99th
/// percentile), told s (time from the arrival until the board tells "reached": the same two).
#[derive(Parser)]
#[command(
    after_help = examples![
        "plumb bench control --rigs 50 --law taut,interval",
        "plumb bench control --suite elastic800 --targets 3",
        "plumb bench control --suite warm800 --law taut --targets 3",
        "plumb bench control --suite paper",
        "plumb bench control --suite path,path-elastic --rigs 20 --law taut,oracle",
    ]
)]
pub(crate) struct ControlArgs {
    /// Suite; several with commas, or given more than once
    #[arg(long, default_value = "quasi-static", value_delimiter = ',')]
    suite: Vec<SuiteArg>,
    /// Law or baseline; several likewise [default: the default law]
    #[arg(long, value_delimiter = ',')]
    law: Vec<ControllerKind>,
    /// Gain of the law interval at 0.471 mm of cable a step, above 0, to 7539 1/s [default: 450]
    #[arg(long, allow_negative_numbers = true, value_parser = numbers::within(numbers::GAMMA))]
    gamma: Option<f64>,
    /// Number of rigs, 1 to 1000000 rigs
    #[arg(long, default_value_t = DEFAULT_RIGS, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u64>(1.0, 1e6, "rigs"))]
    rigs: u64,
    /// Number of the first rig, to repeat one that failed, 0 to 1e9
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u64>(0.0, 1e9, ""))]
    first_rig: u64,
    /// Seed of rigs and noise, 0 to 1e15
    #[arg(long, default_value_t = DEFAULT_SEED, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::seed())]
    seed: u64,
    /// Running mean over the step plan instead of each law's own, 0 to 0.4 s
    #[arg(long, allow_negative_numbers = true, value_parser = numbers::within(Mean::RANGE))]
    mean: Option<f64>,
    /// Targets of each rig, one after the other, 1 to 100 targets. Each has a row, whose times are
    /// multiples of the oracle's from the target before
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u64>(1.0, 100.0, "targets"))]
    targets: u64,
    /// Start of the clock: arrival of the first frame (picture), or 1 to 2 frames earlier, when the
    /// target is set (target)
    #[arg(long, value_enum, default_value = "picture")]
    clock: ClockName,
    /// Draw the share of runs that have reached the target over time into this SVG file
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// End with a line of JSON on standard output for each law and suite; endless times are null
    #[arg(long)]
    json: bool,
}

impl ControlArgs {
    /// Returns the options of the first rig alone.
    #[cfg(test)]
    pub(super) fn first_rig_alone(self) -> Self {
        let Range { start, end } = self.rigs();
        Self { rigs: (end - start).min(1), ..self }
    }

    /// Returns the numbers of the rigs.
    fn rigs(&self) -> Range<u64> {
        self.first_rig..self.first_rig + self.rigs
    }
}

/// Value of `--suite`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SuiteArg {
    /// The paper's task, for several gains.
    Paper,
    /// Simulated rigs, each with a target.
    Rigs(SuiteName),
    /// Simulated rigs, each with paths.
    Paths(PathSuite),
}

impl FromStr for SuiteArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "paper" {
            return Ok(Self::Paper);
        }
        if let Ok(suite) = text.parse() {
            return Ok(Self::Paths(suite));
        }
        let mut known = SuiteName::ALL.map(SuiteName::as_str).to_vec();
        known.extend(PathSuite::ALL.map(PathSuite::as_str));
        let error = |_: UnknownName| format!("one of paper, {}", known.join(", "));
        text.parse().map(Self::Rigs).map_err(error)
    }
}

/// Value of `--clock`.
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

/// Greatest number of failed runs to list.
const MAX_FAILED_LISTED: usize = 12;

pub(crate) fn main(args: &ControlArgs) -> Result<ExitCode, Failure> {
    if args.suite == [SuiteArg::Paper] {
        check_paper_options(args)?;
        return bench_paper(args.json);
    }
    if args.suite.contains(&SuiteArg::Paper) {
        return Err(bad_input("the suite `paper` is of another kind: ask for it alone"));
    }
    let controllers = controllers(args)?;
    if args.suite.iter().any(|suite| matches!(suite, SuiteArg::Paths(_))) {
        check_path_options(args, &controllers)?;
    }
    // The file is created before the runs, so that an error shows at once.
    let create_svg = |file: &PathBuf| check_svg(file).and_then(|()| create(file));
    let svg = args.svg.as_ref().map(create_svg).transpose()?;
    let mut reports = Vec::new();
    for suite in &args.suite {
        let reader = match suite {
            SuiteArg::Rigs(name) => bench_rigs(*name, &controllers, args, &mut reports)?,
            SuiteArg::Paths(suite) => bench_paths(*suite, &controllers, args)?,
            SuiteArg::Paper => Reader::Open,
        };
        if reader == Reader::Closed {
            break;
        }
    }
    if let (Some(mut svg), Some(file)) = (svg, &args.svg) {
        let curves = control::draw_curves(&reports).map_err(failed_because)?;
        let written = svg.write_all(curves.as_bytes());
        written.map_err(|error| {
            let _absent = fs::remove_file(file);
            failed(format!("{}: {}", file.display(), ErrorChain(&error)))
        })?;
        tell!("curves: {}", file.display());
    }
    Ok(ExitCode::SUCCESS)
}

/// Runs the controllers on a suite whose rigs have targets, and adds the results to `reports`.
/// Returns whether anybody still reads the results.
fn bench_rigs(
    name: SuiteName,
    controllers: &[ControllerKind],
    args: &ControlArgs,
    reports: &mut Vec<Report>,
) -> Result<Reader, Failure> {
    let targets = args.targets as usize;
    let suite = Suite { clock: args.clock.into(), targets, ..Suite::new(name) };
    tell!("{}: {}\n{}", suite.name, suite.name.about(), Report::HEADING);
    for controller in controllers {
        for report in measure(controller, &suite, args)? {
            let line = serde_json::to_string(&report)?;
            reports.push(report);
            if args.json && print::results(line)? == Reader::Closed {
                return Ok(Reader::Closed);
            }
        }
    }
    Ok(Reader::Open)
}

/// Runs the controllers on a suite whose rigs have paths. Returns whether anybody still reads the
/// results.
fn bench_paths(
    suite: PathSuite,
    controllers: &[ControllerKind],
    args: &ControlArgs,
) -> Result<Reader, Failure> {
    tell!("{suite}: {}\n{}", suite.about(), PathReport::HEADING);
    for controller in controllers {
        let run = |progress: &mut dyn FnMut(u64)| {
            control::follow_paths(controller, suite, args.rigs(), args.seed, progress)
        };
        for report in with_progress(controller, args, run)? {
            tell!("{report}");
            if !report.losses.is_empty() {
                let lost = report.losses.iter();
                tell!(
                    "  lost: {}",
                    first(lost.map(|(rig, shape, why)| format!("{rig} {shape}: {why}")))
                );
            }
            if args.json && print::results(serde_json::to_string(&report)?)? == Reader::Closed {
                return Ok(Reader::Closed);
            }
        }
    }
    Ok(Reader::Open)
}

/// Creates a file of results.
fn create(file: &Path) -> Result<File, Failure> {
    File::create(file).map_err(|error| bad_input(format!("{}: {error}", file.display())))
}

/// Runs a controller on a suite and prints the progress and the result.
fn measure(
    controller: &ControllerKind,
    suite: &Suite,
    args: &ControlArgs,
) -> Result<Vec<Report>, Failure> {
    let run = |progress: &mut dyn FnMut(u64)| {
        control::run(controller, suite, args.rigs(), args.seed, progress)
    };
    let reports = with_progress(controller, args, run)?;
    for report in &reports {
        tell!("{report}");
        if !report.failed.is_empty() {
            let failed = report.failed.iter().map(|(rig, why)| format!("{rig} {why}"));
            tell!("  failed: {}", first(failed));
        }
        if report.resumed > 0 {
            tell!("  stopped for a lost position and were started again: {}", report.resumed);
        }
    }
    Ok(reports)
}

/// Returns the result of `run`, which tells a terminal its progress.
fn with_progress<T>(
    controller: &ControllerKind,
    args: &ControlArgs,
    run: impl FnOnce(&mut dyn FnMut(u64)) -> Result<T, BenchError>,
) -> Result<T, Failure> {
    let mut line = ProgressLine::shown_if(is_shown());
    let (name, rigs) = (controller.name(), args.rigs);
    Ok(run(&mut |done| line.show(format_args!("{name}: rig {done} of {rigs}"), Instant::now()))?)
}

/// Returns the first ones of a list of failed runs.
fn first(runs: impl Iterator<Item = String>) -> String {
    runs.take(MAX_FAILED_LISTED).collect::<Vec<_>>().join(", ")
}

/// Returns the controllers of the options, with the law parameters of the options.
fn controllers(args: &ControlArgs) -> Result<Vec<ControllerKind>, Failure> {
    let mut controllers = args.law.clone();
    if controllers.is_empty() {
        controllers.push(ControllerKind::Board(LawSettings::default()));
    }
    let mut has_gamma = args.gamma.is_none();
    for law in controllers.iter_mut().filter_map(ControllerKind::settings_mut) {
        has_gamma |= law.set_gamma(args.gamma.unwrap_or(DEFAULT_GAMMA))?;
        if let Some(mean) = args.mean {
            law.set_mean(mean.try_into()?);
        }
    }
    if !has_gamma {
        return Err(bad_input(
            "--gamma is the gain of the law interval, which --law does not name: leave --gamma \
             out, or add interval to --law",
        ));
    }
    Ok(controllers)
}

/// Checks that the controllers can follow paths, and that no option is given that has no effect on
/// the path suites.
fn check_path_options(args: &ControlArgs, controllers: &[ControllerKind]) -> Result<(), Failure> {
    if let Some(other) = controllers.iter().find(|controller| !controller.can_follow()) {
        return Err(bad_input(format!(
            "{other} cannot follow a path: leave it out of --law, or choose another suite"
        )));
    }
    let options = [
        ("--targets", args.targets != 1),
        ("--clock", !matches!(args.clock, ClockName::Picture)),
        ("--svg", args.svg.is_some()),
    ];
    match options.iter().find(|(_, is_given)| *is_given) {
        Some((option, _)) => Err(bad_input(format!(
            "{option} has no effect on the suites `path` and `path-elastic`: leave it out, or \
             choose other suites"
        ))),
        None => Ok(()),
    }
}

/// Checks that no option is given that has no effect on the suite `paper`: its law, gains and rig
/// are fixed.
fn check_paper_options(args: &ControlArgs) -> Result<(), Failure> {
    let options = [
        ("--law", !args.law.is_empty()),
        ("--gamma", args.gamma.is_some()),
        ("--rigs", args.rigs != DEFAULT_RIGS),
        ("--first-rig", args.first_rig != 0),
        ("--seed", args.seed != DEFAULT_SEED),
        ("--mean", args.mean.is_some()),
        ("--targets", args.targets != 1),
        ("--clock", !matches!(args.clock, ClockName::Picture)),
        ("--svg", args.svg.is_some()),
    ];
    match options.iter().find(|(_, is_given)| *is_given) {
        Some((option, _)) => Err(bad_input(format!(
            "{option} has no effect on the suite `paper`, whose law, gains and rig are fixed: \
             leave it out, or choose another suite"
        ))),
        None => Ok(()),
    }
}

/// Runs the suite `paper`.
fn bench_paper(json: bool) -> Result<ExitCode, Failure> {
    let suite = control::paper(&PAPER_GAMMAS)?;
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
        print::result(serde_json::to_string(&suite)?)?;
    }
    Ok(ExitCode::SUCCESS)
}
