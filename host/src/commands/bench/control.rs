//! `plumb bench control`: speed of the laws on simulated rigs.

use std::fs::File;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

use clap::{Parser, ValueEnum};
use plumb_bench::UnknownName;
use plumb_bench::control::{self, Clock, ControllerKind, PAPER_GAMMAS, Report, Suite, SuiteName};
use plumb_runtime::rig::LawSettings;

use crate::commands::print::{self, Reader, message, tell};
use crate::commands::{Failure, bad_input, numbers};

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
/// drift, unilateral, bounce4, bounce3, bounce2, elastic, elastic800, elastic150, edge, high,
/// fine, frame5, frame10, frame20 (positions turned about the target), calibrated-board,
/// calibrated-motors, calibrated-ball (the camera's pose by that way of `plumb calibrate`),
/// paper-task.
#[derive(Parser)]
#[command(
    after_help = examples![
        "plumb bench control --rigs 50 --law taut,interval",
        "plumb bench control --suite paper",
    ]
)]
pub(crate) struct ControlArgs {
    /// Suite; several with commas, or given more than once
    #[arg(long, default_value = "quasi-static", value_delimiter = ',')]
    suite: Vec<SuiteArg>,
    /// Law or baseline; several likewise [default: the default law]
    #[arg(long, value_delimiter = ',')]
    law: Vec<ControllerKind>,
    /// Gain of the law interval, 1/s at 0.471 mm of cable a step [default: 450]
    #[arg(long, allow_negative_numbers = true, value_parser = numbers::positive)]
    gamma: Option<f64>,
    /// Number of rigs
    #[arg(long, default_value_t = DEFAULT_RIGS)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    rigs: u64,
    /// Number of the first rig, to repeat one that failed
    #[arg(long, default_value_t = 0)]
    #[arg(value_parser = clap::value_parser!(u64).range(..=1_000_000_000))]
    first_rig: u64,
    /// Seed of rigs and noise
    #[arg(long, default_value_t = DEFAULT_SEED)]
    seed: u64,
    /// Running mean over the step plan, seconds, instead of each law's own
    #[arg(long, allow_negative_numbers = true, value_parser = numbers::finite)]
    mean: Option<f64>,
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

/// Value of `--suite`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SuiteArg {
    /// The paper's task, for several gains.
    Paper,
    /// Simulated rigs.
    Rigs(SuiteName),
}

impl FromStr for SuiteArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "paper" {
            return Ok(Self::Paper);
        }
        let known = SuiteName::ALL.map(SuiteName::as_str).join(", ");
        text.parse().map(Self::Rigs).map_err(|_: UnknownName| format!("one of paper, {known}"))
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
    let suites = suites(args)?;
    let controllers = controllers(args)?;
    // The file is created before the runs, so that an error shows at once.
    let svg = args.svg.as_ref().map(|file| create(file)).transpose()?;
    let mut reports = Vec::new();
    'suites: for suite in &suites {
        tell!("{}: {}\n{}", suite.name, suite.name.about(), Report::HEADING);
        for controller in &controllers {
            let report = measure(controller, suite, args)?;
            let line = serde_json::to_string(&report)?;
            reports.push(report);
            if args.json && print::results(line)? == Reader::Closed {
                break 'suites;
            }
        }
    }
    if let (Some(mut svg), Some(file)) = (svg, &args.svg) {
        svg.write_all(control::draw_curves(&reports)?.as_bytes())?;
        tell!("curves: {}", file.display());
    }
    Ok(ExitCode::SUCCESS)
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
) -> Result<Report, Failure> {
    let terminal = std::io::stderr().is_terminal();
    let mut progress = |done: u64| {
        if terminal {
            message(format_args!("\r{} {done}/{} ", controller.name(), args.rigs));
        }
    };
    let rigs = args.first_rig..args.first_rig + args.rigs;
    let report = control::run(controller, suite, rigs, args.seed, &mut progress)?;
    tell!("{}{report}", if terminal { "\r\x1b[K" } else { "" });
    if !report.failed.is_empty() {
        let first: Vec<String> = report
            .failed
            .iter()
            .take(MAX_FAILED_LISTED)
            .map(|(k, why)| format!("{k} {why}"))
            .collect();
        tell!("  failed: {}", first.join(", "));
    }
    if report.resumed > 0 {
        tell!("  stopped for a lost position and were started again: {}", report.resumed);
    }
    Ok(report)
}

/// Returns the suites of the options, with the clock of the options.
fn suites(args: &ControlArgs) -> Result<Vec<Suite>, Failure> {
    let with_clock = |arg: &SuiteArg| match arg {
        SuiteArg::Rigs(name) => Ok(Suite { clock: args.clock.into(), ..Suite::new(*name) }),
        SuiteArg::Paper => Err(bad_input("the suite `paper` is of another kind: ask for it alone")),
    };
    args.suite.iter().map(with_clock).collect()
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
            law.set_mean(mean.into());
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
