//! `plumb verify`: what holds for every rig of a kind.

mod family;
mod report;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use plumb::rig::Rig;
use plumb_cameras::toml_file::Finite;
use plumb_verify::{Interval, Rigs, Way};

use self::report::Report;
use super::{FAILED, Failure, OrFail, numbers, print};

/// What can be proved of the laws: for every rig of a kind, or for every Jacobian of a family
///
/// A kind of rigs is what is known roughly: the motors of RIG.toml's [simulation] within
/// --tolerance, or ranges LOW,HIGH in metres of D = yA - yB, W = xA - xC, t = (yC - yB)/D; the ball
/// where the three barycentric λ are at least --lambda, h below the motors. Without options: the
/// paper's rig as it was measured, λ >= 0.023, h from 0.1 m to its floor.
///
/// It tells α, β of |dp/du| over all of them, by hand and exactly, and along the ways to RIG.toml's
/// targets; that no Jacobian with these bounds is singular, and how fast law `interval` is at
/// least; the Routh-Hurwitz conditions of law `sign`, expanded; and whether law `sign` lets |e|
/// fall everywhere in that box. Proofs are by whole numbers or by arithmetic rounded outwards. They
/// are about rigid taut cables and positions without noise and latency, rates without limits,
/// motors at one height.
///
/// With --family: FILE.toml has `vertices`, a list of matrices dp/du by rows, [[.., .., ..], [..,
/// .., ..], [.., .., ..]]; it tells whether a matrix between them is singular, and the least |v| of
/// theorem 1.
///
/// Exit codes: 0 all of it proved, 1 something does not hold or was left open, 2 bad input. That α
/// is 0, so that there is no family for law `interval`, is told and is no failure.
#[derive(Parser)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// A rig file with [simulation]; the paper's where none is given
    rig: Option<PathBuf>,
    /// How far each coordinate of a motor may be from where the rig file has it, metres
    #[arg(long, default_value_t = 0.0, value_name = "METRES", value_parser = numbers::finite)]
    tolerance: f64,
    /// D
    #[arg(long, value_parser = range, value_name = "LOW,HIGH")]
    depth: Option<Interval>,
    /// W
    #[arg(long, value_parser = range, value_name = "LOW,HIGH")]
    width: Option<Interval>,
    /// t, within 0,1
    #[arg(long, value_parser = range, value_name = "LOW,HIGH")]
    apex: Option<Interval>,
    /// The least λ, 0 to 0.33; 0.023 for a rig file, 0 with --wide
    #[arg(long, value_parser = numbers::finite)]
    lambda: Option<f64>,
    /// h
    #[arg(long, value_parser = range, value_name = "LOW,HIGH")]
    below: Option<Interval>,
    /// The box of docs/understand/proofs.md: D, W 0.5-1.5 m, t 0-1, the closed triangle, h 0.1-1 m
    #[arg(long, conflicts_with_all = ["rig", "tolerance"])]
    wide: bool,
    /// A family of Jacobians by its vertices, in place of a kind of rigs
    #[arg(long, value_name = "FILE.toml", conflicts_with_all = ["rig", "tolerance", "depth", "width", "apex", "lambda", "below", "wide"])]
    family: Option<PathBuf>,
    /// Cells (with --family: patches of directions, a thousandth of it) after which a question is
    /// left open
    #[arg(long, default_value_t = 20_000_000)]
    cells: usize,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

/// The least λ of a rig file's kind: just so much that the paper's target is in it.
const LAMBDA: f64 = 0.023;

/// The least h of it, metres.
const LEAST_BELOW_M: f64 = 0.1;

fn range(text: &str) -> Result<Interval, String> {
    let numbers: Vec<f64> = text.split(',').map_while(|part| part.trim().parse().ok()).collect();
    match numbers[..] {
        [lo, hi] if lo <= hi && lo >= 0.0 && hi <= 100.0 => Ok(Interval::new(lo, hi)),
        _ => Err("two numbers, LOW,HIGH, from 0 to 100".to_owned()),
    }
}

/// A way, and the target it leads to.
type Ways = Vec<([f64; 3], Way)>;

/// What is asked about: rigs, and ways in the one of them that is written down.
struct Question {
    rigs: Rigs,
    ways: Ways,
}

impl Question {
    fn new(args: &Args) -> Result<Self, Failure> {
        let (base, ways) =
            if args.wide { (Rigs::wide(LEAST_BELOW_M), Vec::new()) } else { of_file(args)? };
        let rigs = Rigs {
            depth: args.depth.unwrap_or(base.depth),
            width: args.width.unwrap_or(base.width),
            apex: args.apex.unwrap_or(base.apex),
            least_lambda: args.lambda.unwrap_or(base.least_lambda),
            below: args.below.unwrap_or(base.below),
        };
        // Ways belong to the rig file's rig.
        let ways = if [args.depth, args.width, args.apex].iter().all(Option::is_none) {
            ways
        } else {
            Vec::new()
        };
        Ok(Self { rigs: rigs.check().or_bad_input()?, ways })
    }
}

/// The rigs around a rig file's, and its ways.
fn of_file(args: &Args) -> Result<(Rigs, Ways), Failure> {
    let rig = args.rig.as_ref().map_or_else(Rig::paper, |path| Rig::read(path)).or_bad_input()?;
    let Some(simulation) = rig.simulation else {
        return Err("the rig file has no [simulation] with the motors' places: add it, or give --depth, --width and --apex")
            .or_bad_input();
    };
    let motors = simulation.motors.map(|motor| motor.map(Finite::get));
    let below = Interval::new(LEAST_BELOW_M, motors[0][2].max(LEAST_BELOW_M));
    if !(0.0..=1.0).contains(&args.tolerance) {
        return Err("--tolerance is a length from 0 to 1 m").or_bad_input();
    }
    let rigs = Rigs::around(&motors, args.tolerance, LAMBDA, below).or_bad_input()?;
    let mut start = simulation.start.map(Finite::get);
    let mut ways = Vec::new();
    for target in rig.targets.iter().map(|target| target.map(Finite::get)) {
        ways.push((target, Way::new(&motors, start, target).or_bad_input()?));
        start = target;
    }
    Ok((rigs, ways))
}

pub(crate) fn main(args: Args) -> Result<ExitCode, Failure> {
    let proved = if let Some(path) = &args.family {
        family::main(path, args.cells / 1000, args.json)?
    } else {
        let question = Question::new(&args)?;
        let report = Report::new(&question, args.cells);
        report.tell();
        if args.json {
            print::result(serde_json::to_string(&report).or_failed()?)?;
        }
        report.proved()
    };
    Ok(if proved { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}
