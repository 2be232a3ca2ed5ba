//! `plumb-lab calibration`: the error of the camera's pose by each way of `plumb calibrate`.

use clap::{Parser, value_parser};
use plumb_bench::calibration::{CalibrationWay, Survey, survey};

use crate::output::{self, Failure, failed, progress};

/// Accuracy of the camera's pose by each way of `plumb calibrate`, on random rigs
///
/// Ways: board, motors, ball. The pictures of the board are rendered with noise; depth, pixels and
/// measured places have the errors that the book's page "Results" lists. A refused or poor
/// calibration is repeated with other errors.
#[derive(Parser)]
pub(crate) struct Args {
    /// Way; several with commas [default: all]
    #[arg(long, value_delimiter = ',')]
    way: Vec<CalibrationWay>,
    /// Number of rigs, 1 to 100000 rigs
    #[arg(long, default_value_t = 200, value_parser = value_parser!(u64).range(1..=100_000))]
    rigs: u64,
    /// Seed of rigs and errors, 0 to 1e15
    #[arg(long, default_value_t = 1)]
    #[arg(value_parser = value_parser!(u64).range(..=1_000_000_000_000_000))]
    seed: u64,
    /// End with a line of JSON on standard output for each way
    #[arg(long)]
    json: bool,
}

pub(crate) fn main(args: &Args) -> Result<(), Failure> {
    let ways = if args.way.is_empty() { &CalibrationWay::ALL[..] } else { &args.way };
    tell!("{}", Survey::HEADING);
    for &way in ways {
        let progress = progress(way, args.rigs);
        let survey = survey(way, args.rigs, args.seed, progress).map_err(failed)?;
        tell!("{survey}");
        if args.json {
            output::print(&survey)?;
        }
    }
    Ok(())
}
