//! `plumb-lab control`, `paths` and `paper`: speed and accuracy of the laws on simulated rigs.

use std::ops::Range;

use clap::{Parser, value_parser};
use plumb_bench::control::{
    self, Clock, ControllerKind, Defect, PAPER_GAMMAS, PathReport, PathSuite, Report, Stand, Suite,
    SuiteName, TapeMeasure,
};
use plumb_runtime::rig::LawSettings;
use plumb_runtime::rig::quantity::{Gain, Mean};

use crate::output::{self, Failure, bad_input, failed, progress};
use crate::within;

/// Gain γ of the law interval in the benchmarks, 1/s: fast without oscillation at 30 Hz.
const DEFAULT_GAMMA: f64 = 450.0;

/// Greatest number of failed runs to list.
const MAX_FAILED_LISTED: usize = 12;

/// Speed of the laws on simulated rigs, with the board's own arithmetic
///
/// Laws: interval, sign, adaptive, taut; baselines: broyden (uncalibrated servoing), model-5,
/// model-10, model-20 (inverse kinematics, with that error of the geometry in percent); limits:
/// oracle, reference (slack-free). Times are multiples of the time of an oracle with a perfect
/// model. Suites: quasi-static, yaw, tilt, radii, heights, noise, outliers, ages, latency, drift,
/// unilateral, bounce4, bounce3, bounce2, elastic, elastic800, elastic150, stiff, warm800,
/// warm150, warm-moved, warm-pulleys (each further target is a run of its own), edge, high, fine,
/// frame5, frame10, frame20 (positions turned about the target), planar, planar800, planar150 (two
/// motors in a plane; laws interval, sign, adaptive), picture, picture800, picture150 (the same, in
/// the picture of a camera of unknown place, after two jogs), paper-task.
///
/// Columns: converged (share of the runs in which the ball arrived and stayed), median, p90, p99
/// and max (time to the target over the oracle's), slack (share of the runs with a cable slack for
/// more than 20 ms), hold (mean distance from the target afterwards, and its 99th percentile),
/// false (share of the runs that told "reached" with the ball elsewhere), median s (time to the
/// target), lost s (that time less the oracle's: its median and 99th percentile), told s (time from
/// the arrival until the board tells "reached": the same two).
#[derive(Parser)]
#[command(after_help = "Examples:
  plumb-lab control --rigs 50 --law taut,interval
  plumb-lab control --suite elastic800 --targets 3
  plumb-lab control --suite warm800 --law taut --targets 3
  plumb-lab control --suite planar --law interval,sign,adaptive")]
pub(crate) struct Args {
    /// Suite; several with commas, or given more than once
    #[arg(long, default_value = "quasi-static", value_delimiter = ',')]
    suite: Vec<SuiteName>,
    #[command(flatten)]
    runs: Runs,
    /// Targets of each rig, one after the other, 1 to 100 targets. Each has a row, whose times are
    /// multiples of the oracle's from the target before
    #[arg(long, default_value_t = 1, value_parser = value_parser!(u64).range(1..=100))]
    targets: u64,
    /// Measure of the rigs with which the law taut begins: exact, 5, 10, 20 or 40 (percent of the
    /// longest side that each coordinate is off by at most, and the cable of a step), exchanged,
    /// turned (motors under other names), feet (read as metres)
    #[arg(long)]
    size: Option<TapeMeasure>,
    /// Camera of the suites picture, picture800 and picture150: front, mirrored, upside-down,
    /// behind (the plane), rolled60, rolled90, kept (in front, with the jogs of an earlier run)
    #[arg(long, default_value = "front")]
    stand: Stand,
    /// What breaks 0.5 s after the start of such a run: stuck (motor A stands), caught (the ball is
    /// held), reversed (motor A), knocked (the camera is turned by 5°)
    #[arg(long)]
    defect: Option<Defect>,
    /// Start of the clock: arrival of the first frame (picture), or 1 to 2 frames earlier, when the
    /// target is set (target)
    #[arg(long, default_value = "picture")]
    clock: Clock,
    /// End with a line of JSON on standard output for each law and suite; endless times are null
    #[arg(long)]
    json: bool,
}

/// Deviations of the laws from paths at 2, 5, 10 and 20 cm/s on simulated rigs
///
/// Suites: path (rigid cables), path-elastic (800 and 150 N/m in turn), path-picture (a circle at 5
/// and 10 cm/s in the picture of two cables). With the laws, broyden and the models of
/// `plumb-lab control`.
#[derive(Parser)]
#[command(after_help = "Example:
  plumb-lab paths --suite path,path-elastic --rigs 20 --law taut,broyden")]
pub(crate) struct PathsArgs {
    /// Suite; several with commas, or given more than once
    #[arg(long, default_value = "path", value_delimiter = ',')]
    suite: Vec<PathSuite>,
    #[command(flatten)]
    runs: Runs,
    /// End with a line of JSON on standard output for each law, suite and speed; endless deviations
    /// are null
    #[arg(long)]
    json: bool,
}

/// Frames of the law interval to 10 mm of the paper's target, for several γ
#[derive(Parser)]
pub(crate) struct PaperArgs {
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Controllers and rigs of a measurement.
#[derive(clap::Args)]
struct Runs {
    /// Law or baseline; several with commas, or given more than once [default: the default law]
    #[arg(long, value_delimiter = ',')]
    law: Vec<ControllerKind>,
    /// Gain of the law interval at 0.471 mm of cable a step, above 0, to 7539 1/s [default: 450]
    #[arg(long, value_parser = within(Gain::RANGE))]
    gamma: Option<f64>,
    /// Number of rigs, 1 to 1000000 rigs
    #[arg(long, default_value_t = 300)]
    #[arg(value_parser = value_parser!(u64).range(1..=1_000_000))]
    rigs: u64,
    /// Number of the first rig, to repeat one that failed, 0 to 1e9
    #[arg(long, default_value_t = 0, value_parser = value_parser!(u64).range(..=1_000_000_000))]
    first_rig: u64,
    /// Seed of rigs and noise, 0 to 1e15
    #[arg(long, default_value_t = 1)]
    #[arg(value_parser = value_parser!(u64).range(..=1_000_000_000_000_000))]
    seed: u64,
    /// Running mean over the step plan instead of each controller's own, 0 to 0.4 s
    #[arg(long, value_parser = within(Mean::RANGE))]
    mean: Option<f64>,
}

pub(crate) fn main(args: &Args) -> Result<(), Failure> {
    let controllers = args.runs.controllers()?;
    args.suite.iter().try_for_each(|suite| bench_rigs(*suite, &controllers, args))
}

pub(crate) fn paths(args: &PathsArgs) -> Result<(), Failure> {
    let controllers = args.runs.controllers()?;
    if let Some(other) = controllers.iter().find(|controller| !controller.can_go_on()) {
        return Err(bad_input(format!("{other} cannot follow a path: leave it out of --law")));
    }
    args.suite.iter().try_for_each(|suite| bench_paths(*suite, &controllers, args))
}

/// Runs the controllers on a suite whose rigs have targets, and prints the results.
fn bench_rigs(name: SuiteName, controllers: &[ControllerKind], args: &Args) -> Result<(), Failure> {
    let mut suite = Suite {
        clock: args.clock,
        targets: args.targets as usize,
        tape: args.size,
        ..Suite::new(name)
    };
    if let Some(stand) = &mut suite.stand {
        *stand = args.stand;
        suite.defect = args.defect;
    }
    tell!("{name}: {}\n{}", name.about(), Report::HEADING);
    if suite.stand.is_some() {
        let jogs = control::jogs(&suite, args.runs.rigs(), args.runs.seed, &mut |_| ())?;
        tell!("  jogs: {jogs}");
        if args.json {
            output::print(&jogs)?;
        }
    }
    for controller in controllers {
        let mut progress = progress(controller, args.runs.rigs);
        let (rigs, seed) = (args.runs.rigs(), args.runs.seed);
        let reports = control::run(controller, &suite, rigs, seed, &mut progress)?;
        for report in &reports {
            tell!("{report}");
            list("failed", report.failed.iter().map(|(rig, why)| format!("{rig} {why}")));
            for (fault, count, median_s) in &report.faults {
                tell!("  stopped by {fault}: {count}, after {median_s:.2} s (median)");
            }
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
    args: &PathsArgs,
) -> Result<(), Failure> {
    tell!("{suite}: {}\n{}", suite.about(), PathReport::HEADING);
    for controller in controllers {
        let mut progress = progress(controller, args.runs.rigs);
        let (rigs, seed) = (args.runs.rigs(), args.runs.seed);
        for report in control::follow_paths(controller, suite, rigs, seed, &mut progress)? {
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

impl Runs {
    /// Returns the numbers of the rigs.
    fn rigs(&self) -> Range<u64> {
        self.first_rig..self.first_rig + self.rigs
    }

    /// Returns the controllers, with the law parameters of the options.
    fn controllers(&self) -> Result<Vec<ControllerKind>, Failure> {
        let mut controllers = self.law.clone();
        if controllers.is_empty() {
            controllers.push(ControllerKind::Board(LawSettings::default()));
        }
        let mut has_gamma = self.gamma.is_none();
        for law in controllers.iter_mut().filter_map(ControllerKind::settings_mut) {
            let gamma = self.gamma.unwrap_or(DEFAULT_GAMMA);
            has_gamma |= law.set_gamma(gamma).map_err(bad_input)?;
        }
        if let Some(mean) = self.mean {
            let mean = mean.try_into().map_err(bad_input)?;
            controllers.iter_mut().for_each(|controller| controller.set_mean(mean));
        }
        if !has_gamma {
            return Err(bad_input(
                "--gamma is the gain of the law interval, which --law does not name: leave \
                 --gamma out, or add interval to --law",
            ));
        }
        Ok(controllers)
    }
}

/// Measures the paper's law on the paper's task, and prints the results.
pub(crate) fn paper(args: &PaperArgs) -> Result<(), Failure> {
    let suite = control::paper(&PAPER_GAMMAS).map_err(failed)?;
    tell!(
        "law interval on the paper's task, no noise, 30 Hz: frames to 10 mm (the paper: 17 100/γ)"
    );
    for (gamma, frames) in suite.gamma.iter().zip(&suite.frames) {
        let product = gamma * f64::from(*frames);
        tell!("  γ = {gamma:4} /s  {frames:5} frames  γ·frames = {product:6.0}");
    }
    if args.json { output::print(&suite) } else { Ok(()) }
}
