//! `plumb-lab verify`: proofs about the control laws, for a family of rigs or of Jacobians.

mod family;
mod report;

use std::path::PathBuf;

use clap::builder::TypedValueParser;
use clap::{Parser, value_parser};
use plumb_config::quantity::{Coordinate, Range};
use plumb_runtime::rig::Rig;
use plumb_verify::{BallPath, Interval, RigFamily};

use self::report::Report;
use crate::output::{self, Failure, bad_input};
use crate::within;

/// Proofs about the control laws, for a family of rigs or for a family of Jacobians
///
/// A family of rigs is either the motors of the rig file's [simulation], each coordinate within
/// --tolerance, or ranges LOW,HIGH of D = yA - yB, W = xA - xC and t = (yC - yB)/D. The ball is
/// where the three barycentric coordinates λ are at least --lambda, at a depth h below the motors.
/// Without options: the paper's rig as measured, λ >= 0.023, h from 0.1 m to the floor.
///
/// The report has:
/// - the bounds α and β of |dp/du| over the family (exact and in closed form), and along the
///   straight paths to the rig file's targets;
/// - whether a Jacobian with these bounds is singular, and the slowest decay under law `interval`;
/// - the Routh-Hurwitz conditions of law `sign`;
/// - whether law `sign` decreases |e| everywhere in the family.
///
/// Proofs use exact integers or interval arithmetic with outward rounding. They assume rigid, taut
/// cables, motors at one height, positions without noise and latency, and rates without limits.
///
/// With --family: FILE.toml has `vertices`, a list of matrices dp/du by rows,
/// [[.., .., ..], [.., .., ..], [.., .., ..]]. The report states whether a matrix in their convex
/// hull is singular, and gives the minimum of |v| of theorem 1.
///
/// Exit codes: 0 everything is proved, 1 something is refuted or undecided, 2 bad input. α = 0
/// (no family for law `interval`) is reported and is not a failure.
#[derive(Parser)]
#[command(
    verbatim_doc_comment,
    after_help = "Examples:
  plumb-lab verify --rig rig.toml --tolerance 0.01
  plumb-lab verify --wide"
)]
pub(crate) struct Args {
    /// Rig file with [simulation]; default: the paper's rig
    #[arg(short, long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Tolerance of each coordinate of a motor, 0 to 1 m
    #[arg(long, default_value_t = 0.0, value_name = "METRES", value_parser = within(TOLERANCE))]
    tolerance: f64,
    /// Range of the distance of motors A and B along y, 0 to 100 m (D)
    #[arg(long, value_parser = range(LENGTH), value_name = "LOW,HIGH")]
    depth: Option<Interval>,
    /// Range of the distance of motors A and C along x, 0 to 100 m (W)
    #[arg(long, value_parser = range(LENGTH), value_name = "LOW,HIGH")]
    width: Option<Interval>,
    /// Range of motor C's place between B and A along y, 0 to 1 (t)
    #[arg(long, value_parser = range(SHARE), value_name = "LOW,HIGH")]
    apex: Option<Interval>,
    /// Minimum of the ball's barycentric coordinates, 0 to 0.33; default: 0.023, 0 with --wide (λ)
    #[arg(long, value_parser = within(LAMBDA))]
    lambda: Option<f64>,
    /// Range of the ball's depth below the motors, 0 to 100 m (h)
    #[arg(long, value_parser = range(LENGTH), value_name = "LOW,HIGH")]
    below: Option<Interval>,
    /// Wide family (in the book: "What is proved"): D, W 0.5-1.5 m, t 0-1, the closed triangle, h
    /// 0.1-1 m
    #[arg(long, conflicts_with_all = ["rig", "tolerance"])]
    wide: bool,
    /// File with a family of Jacobians by its vertices, in place of a family of rigs
    #[arg(
        long,
        value_name = "FILE.toml",
        conflicts_with_all =
            ["rig", "tolerance", "depth", "width", "apex", "lambda", "below", "wide"]
    )]
    family: Option<PathBuf>,
    /// Maximum number of cells of a search, 1 to 1e12; with --family, a thousandth of it is the
    /// maximum number of patches of directions
    #[arg(long, default_value_t = 20_000_000)]
    #[arg(value_parser = value_parser!(u64).range(1..=1_000_000_000_000))]
    cells: u64,
    /// Print a line of JSON to standard output at the end
    #[arg(long)]
    json: bool,
}

/// Default minimum of λ for a rig file; the largest with which the paper's target is inside.
const MIN_LAMBDA: f64 = 0.023;

/// Default minimum of h, metres.
const MIN_BELOW_M: f64 = 0.1;

/// Cells for each patch of directions: a patch solves a QP, and a cell only evaluates a formula.
const CELLS_PER_PATCH: u64 = 1000;

/// Tolerance of a coordinate.
const TOLERANCE: Range = Range::new(0.0, 1.0, "m");

/// Share of a length.
const SHARE: Range = Range::new(0.0, 1.0, "");

/// Lengths of a family of rigs.
const LENGTH: Range = Range::new(0.0, 100.0, "m");

/// Minimum of λ.
const LAMBDA: Range = Range::new(0.0, 0.33, "");

/// Returns the parser of LOW,HIGH.
fn range(range: Range) -> impl TypedValueParser<Value = Interval> {
    move |text: &str| {
        let numbers: Result<Vec<f64>, String> =
            text.split(',').map(|part| range.parse(part.trim())).collect();
        match numbers?[..] {
            [lo, hi] if lo <= hi => Ok(Interval::new(lo, hi)),
            [lo, hi] => Err(format!("{lo} is above {hi}: write LOW,HIGH")),
            _ => Err(format!("two numbers, LOW,HIGH, each must be {range}")),
        }
    }
}

/// A straight path and its target.
struct TargetPath {
    target: [f64; 3],
    path: BallPath,
}

/// The rigs to verify, and the paths in the rig of the file.
struct Scope {
    rigs: RigFamily,
    paths: Vec<TargetPath>,
}

impl Scope {
    fn new(args: &Args) -> Result<Self, Failure> {
        let base = if args.wide {
            Self { rigs: RigFamily::wide(MIN_BELOW_M), paths: Vec::new() }
        } else {
            Self::of_file(args)?
        };
        let rigs = RigFamily {
            depth: args.depth.unwrap_or(base.rigs.depth),
            width: args.width.unwrap_or(base.rigs.width),
            apex: args.apex.unwrap_or(base.rigs.apex),
            min_lambda: args.lambda.unwrap_or(base.rigs.min_lambda),
            below: args.below.unwrap_or(base.rigs.below),
        };
        // The paths belong to the rig of the file.
        let is_files_rig = [args.depth, args.width, args.apex].iter().all(Option::is_none);
        let paths = if is_files_rig { base.paths } else { Vec::new() };
        Ok(Self { rigs: rigs.check().map_err(bad_input)?, paths })
    }

    /// Returns the rigs around the rig of the file, and its paths.
    fn of_file(args: &Args) -> Result<Self, Failure> {
        let rig = args.rig.as_ref().map_or_else(Rig::paper, |path| Rig::read(path));
        let rig = rig.map_err(bad_input)?;
        let Some(simulation) = &rig.simulation else {
            return Err(bad_input(
                "the rig file has no [simulation] with the positions of the motors: \
                        add it, or give --depth, --width and --apex",
            ));
        };
        let motors = simulation.motors.map(|motor| motor.map(Coordinate::get));
        let [a, b, c] = motors[..] else {
            return Err(bad_input("it verifies rigs of three motors; see `motors.count`"));
        };
        let motors = [a, b, c];
        let below = Interval::new(MIN_BELOW_M, motors[0][2].max(MIN_BELOW_M));
        let rigs = RigFamily::around(&motors, args.tolerance, MIN_LAMBDA, below);
        let rigs = rigs.map_err(bad_input)?;
        let mut start = simulation.start.map(Coordinate::get);
        let mut paths = Vec::new();
        for target in rig.target_places() {
            let path = BallPath::new(&motors, start, target).map_err(bad_input)?;
            paths.push(TargetPath { target, path });
            start = target;
        }
        Ok(Self { rigs, paths })
    }
}

/// Prints what is proved. Returns whether that is everything.
pub(crate) fn main(args: &Args) -> Result<bool, Failure> {
    if let Some(path) = &args.family {
        return family::main(path, (args.cells / CELLS_PER_PATCH) as usize, args.json);
    }
    let report = Report::new(&Scope::new(args)?, args.cells as usize);
    report.print();
    if args.json {
        output::print(&report)?;
    }
    Ok(report.is_proved())
}
