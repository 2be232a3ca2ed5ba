//! `plumb-lab control`: speed of the laws on simulated rigs.

use std::ops::Range;
use std::str::FromStr;

use clap::{Parser, value_parser};
use plumb_bench::UnknownName;
use plumb_bench::control::{
    self, Clock, ControllerKind, PAPER_GAMMAS, PathReport, PathSuite, Report, Suite, SuiteName,
};
use plumb_runtime::rig::LawSettings;
use plumb_runtime::rig::quantity::{Gain, Mean};

use crate::output::{self, Failure, bad_input, failed, progress};
use crate::within;

/// Gain γ of the law interval in the benchmarks, 1/s: fast without oscillation at 30 Hz.
const DEFAULT_GAMMA: f64 = 450.0;

/// Number of rigs of a suite.
const DEFAULT_RIGS: u64 = 300;

/// Seed of rigs and noise.
const DEFAULT_SEED: u64 = 1;

/// Greatest number of failed runs to list.
const MAX_FAILED_LISTED: usize = 12;

/// Speed of the laws on simulated rigs, with the board's own arithmetic
///
/// Laws: interval, sign, adaptive, taut; baselines: broyden (uncalibrated servoing), model-5,
/// model-10, model-20 (inverse kinematics, with that error of the geometry in percent); limits:
/// oracle, reference (slack-free). Times are multiples of the time of an oracle with a perfect
/// model. Suites: paper (frames to 10 mm of the paper's task for several γ), quasi-static, yaw,
/// tilt, radii, heights, noise, outliers, ages, latency, drift, unilateral, bounce4, bounce3,
/// bounce2, elastic, elastic800, elastic150, stiff, warm800, warm150, warm-moved, warm-pulleys
/// (each further target is a run of its own), edge, high, fine, frame5, frame10, frame20
/// (positions turned about the target), paper-task. The ball follows paths at 2, 5, 10 and
/// 20 cm/s: path (rigid cables), path-elastic; with the laws, broyden, the models and oracle.
///
/// Columns of a suite with targets: converged (share of the runs in which the ball arrived and
/// stayed), median, p90, p99 and max (time to the target over the oracle's), slack (share of the
/// runs with a cable slack for more than 20 ms), hold (mean distance from the target afterwards,
/// and its 99th percentile), false (share of the runs that told "reached" with the ball elsewhere),
/// median s (time to the target), lost s (that time less the oracle's: its median and 99th
/// percentile), told s (time from the arrival until the board tells "reached": the same two).
#[derive(Parser)]
#[command(after_help = "Examples:
  plumb-lab control --rigs 50 --law taut,interval
  plumb-lab control --suite elastic800 --targets 3
  plumb-lab control --suite warm800 --law taut --targets 3
  plumb-lab control --suite paper
  plumb-lab control --suite path,path-elastic --rigs 20 --law taut,oracle")]
pub(crate) struct Args {
    /// Suite; several with commas, or given more than once
    #[arg(long, default_value = "quasi-static", value_delimiter = ',')]
    suite: Vec<SuiteArg>,
    /// Law or baseline; several likewise [default: the default law]
    #[arg(long, value_delimiter = ',')]
    law: Vec<ControllerKind>,
    /// Gain of the law interval at 0.471 mm of cable a step, above 0, to 7539 1/s [default: 450]
    #[arg(long, value_parser = within(Gain::RANGE))]
    gamma: Option<f64>,
    /// Number of rigs, 1 to 1000000 rigs
    #[arg(long, default_value_t = DEFAULT_RIGS)]
    #[arg(value_parser = value_parser!(u64).range(1..=1_000_000))]
    rigs: u64,
    /// Number of the first rig, to repeat one that failed, 0 to 1e9
    #[arg(long, default_value_t = 0, value_parser = value_parser!(u64).range(..=1_000_000_000))]
    first_rig: u64,
    /// Seed of rigs and noise, 0 to 1e15
    #[arg(long, default_value_t = DEFAULT_SEED)]
    #[arg(value_parser = value_parser!(u64).range(..=1_000_000_000_000_000))]
    seed: u64,
    /// Running mean over the step plan instead of each law's own, 0 to 0.4 s
    #[arg(long, value_parser = within(Mean::RANGE))]
    mean: Option<f64>,
    /// Targets of each rig, one after the other, 1 to 100 targets. Each has a row, whose times are
    /// multiples of the oracle's from the target before
    #[arg(long, default_value_t = 1, value_parser = value_parser!(u64).range(1..=100))]
    targets: u64,
    /// Start of the clock: arrival of the first frame (picture), or 1 to 2 frames earlier, when the
    /// target is set (target)
    #[arg(long, default_value = "picture")]
    clock: Clock,
    /// End with a line of JSON on standard output for each law and suite; endless times are null
    #[arg(long)]
    json: bool,
}

impl Args {
    /// Returns the numbers of the rigs.
    fn rigs(&self) -> Range<u64> {
        self.first_rig..self.first_rig + self.rigs
    }
}

/// Value of `--suite`.
#[derive(Clone, Copy, PartialEq, Eq)]
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
        let paths = text.parse().map(Self::Paths);
        paths.or_else(|paths: UnknownName| {
            let error = |rigs: UnknownName| format!("paper, or {paths}, or {rigs}");
            text.parse().map(Self::Rigs).map_err(error)
        })
    }
}

pub(crate) fn main(args: &Args) -> Result<(), Failure> {
    check(args)?;
    if args.suite.contains(&SuiteArg::Paper) {
        return bench_paper(args.json);
    }
    let controllers = controllers(args)?;
    for suite in &args.suite {
        match suite {
            SuiteArg::Rigs(name) => bench_rigs(*name, &controllers, args)?,
            SuiteArg::Paths(suite) => bench_paths(*suite, &controllers, args)?,
            SuiteArg::Paper => {}
        }
    }
    Ok(())
}

/// Checks that every option has an effect on every suite, and that the controllers can follow paths
/// where a suite has some.
fn check(args: &Args) -> Result<(), Failure> {
    let is_paper = args.suite.contains(&SuiteArg::Paper);
    if is_paper && args.suite.len() > 1 {
        return Err(bad_input("the suite `paper` is of another kind: ask for it alone"));
    }
    if !is_paper && !args.suite.iter().any(|suite| matches!(suite, SuiteArg::Paths(_))) {
        return Ok(());
    }
    let given = [
        ("--targets", args.targets != 1),
        ("--clock", args.clock != Clock::Picture),
        ("--law", is_paper && !args.law.is_empty()),
        ("--gamma", is_paper && args.gamma.is_some()),
        ("--rigs", is_paper && args.rigs != DEFAULT_RIGS),
        ("--first-rig", is_paper && args.first_rig != 0),
        ("--seed", is_paper && args.seed != DEFAULT_SEED),
        ("--mean", is_paper && args.mean.is_some()),
    ];
    let suites = if is_paper {
        "suite `paper`, whose law, gains and rig are fixed"
    } else {
        "suites `path` and `path-elastic`"
    };
    if let Some((option, _)) = given.iter().find(|(_, is_given)| *is_given) {
        return Err(bad_input(format!(
            "{option} has no effect on the {suites}: leave it out, or choose another suite"
        )));
    }
    match args.law.iter().find(|controller| !controller.can_follow()) {
        Some(other) => Err(bad_input(format!(
            "{other} cannot follow a path: leave it out of --law, or choose another suite"
        ))),
        None => Ok(()),
    }
}

/// Runs the controllers on a suite whose rigs have targets, and prints the results.
fn bench_rigs(name: SuiteName, controllers: &[ControllerKind], args: &Args) -> Result<(), Failure> {
    let suite = Suite { clock: args.clock, targets: args.targets as usize, ..Suite::new(name) };
    tell!("{name}: {}\n{}", name.about(), Report::HEADING);
    for controller in controllers {
        let mut progress = progress(controller, args.rigs);
        let reports = control::run(controller, &suite, args.rigs(), args.seed, &mut progress)?;
        for report in &reports {
            tell!("{report}");
            list("failed", report.failed.iter().map(|(rig, why)| format!("{rig} {why}")));
            if report.resumed > 0 {
                let count = report.resumed;
                tell!("  stopped for a lost position and were started again: {count}");
            }
        }
        if args.json {
            reports.iter().try_for_each(output::print)?;
        }
    }
    Ok(())
}

/// Runs the controllers on a suite whose rigs have paths, and prints the results.
fn bench_paths(
    suite: PathSuite,
    controllers: &[ControllerKind],
    args: &Args,
) -> Result<(), Failure> {
    tell!("{suite}: {}\n{}", suite.about(), PathReport::HEADING);
    for controller in controllers {
        let mut progress = progress(controller, args.rigs);
        let rigs = args.rigs();
        for report in control::follow_paths(controller, suite, rigs, args.seed, &mut progress)? {
            tell!("{report}");
            let losses = report.losses.iter();
            list("lost", losses.map(|(rig, shape, why)| format!("{rig} {shape}: {why}")));
            if args.json {
                output::print(&report)?;
            }
        }
    }
    Ok(())
}

/// Prints the first ones of a list of failed runs, if there are any.
fn list(what: &str, runs: impl Iterator<Item = String>) {
    let first: Vec<String> = runs.take(MAX_FAILED_LISTED).collect();
    if !first.is_empty() {
        tell!("  {what}: {}", first.join(", "));
    }
}

/// Returns the controllers of the options, with the law parameters of the options.
fn controllers(args: &Args) -> Result<Vec<ControllerKind>, Failure> {
    let mut controllers = args.law.clone();
    if controllers.is_empty() {
        controllers.push(ControllerKind::Board(LawSettings::default()));
    }
    let mut has_gamma = args.gamma.is_none();
    for law in controllers.iter_mut().filter_map(ControllerKind::settings_mut) {
        let gamma = args.gamma.unwrap_or(DEFAULT_GAMMA);
        has_gamma |= law.set_gamma(gamma).map_err(bad_input)?;
        if let Some(mean) = args.mean {
            law.set_mean(mean.try_into().map_err(bad_input)?);
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

/// Runs the suite `paper`.
fn bench_paper(json: bool) -> Result<(), Failure> {
    let suite = control::paper(&PAPER_GAMMAS).map_err(failed)?;
    tell!(
        "law interval on the paper's task, no noise, 30 Hz: frames to 10 mm (the paper: 17 100/γ)"
    );
    for (gamma, frames) in suite.gamma.iter().zip(&suite.frames) {
        let product = gamma * f64::from(*frames);
        tell!("  γ = {gamma:4} /s  {frames:5} frames  γ·frames = {product:6.0}");
    }
    if json { output::print(&suite) } else { Ok(()) }
}
