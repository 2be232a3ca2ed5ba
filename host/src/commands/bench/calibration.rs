//! `plumb bench calibration`: the error of the camera's pose by each way of `plumb calibrate`.

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use plumb_bench::calibration::{CalibrationWay, Survey, survey};

use crate::commands::print::{self, tell};
use crate::commands::progress::{ProgressLine, is_shown};
use crate::commands::{Failure, failed_because, numbers};

/// Accuracy of the camera's pose by each way of `plumb calibrate`, on random rigs
///
/// Ways: board, motors, ball. The pictures of the board are rendered with noise; depth, pixels and
/// measured places have the errors that the book's page "Results" lists. A refused or poor
/// calibration is repeated with other errors.
#[derive(Parser)]
pub(crate) struct CalibrationArgs {
    /// Way; several with commas [default: all]
    #[arg(long, value_delimiter = ',')]
    way: Vec<CalibrationWay>,
    /// Number of rigs, 1 to 100000 rigs
    #[arg(long, default_value_t = 200, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u64>(1.0, 1e5, "rigs"))]
    rigs: u64,
    /// Seed of rigs and errors, 0 to 1e15
    #[arg(long, default_value_t = 1, allow_negative_numbers = true, value_parser = numbers::seed())]
    seed: u64,
    /// End with a line of JSON on standard output for each way
    #[arg(long)]
    json: bool,
}

impl CalibrationArgs {
    /// Returns the options of the first rig alone.
    #[cfg(test)]
    pub(super) fn first_rig_alone(self) -> Self {
        Self { rigs: self.rigs.min(1), ..self }
    }
}

pub(super) fn main(args: &CalibrationArgs) -> Result<ExitCode, Failure> {
    let ways = if args.way.is_empty() { &CalibrationWay::ALL[..] } else { &args.way };
    tell!("{}", Survey::HEADING);
    for &way in ways {
        let survey = with_progress(way, args)?;
        tell!("{survey}");
        if args.json {
            print::result(serde_json::to_string(&survey)?)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Measures a way, and tells a terminal the progress.
fn with_progress(way: CalibrationWay, args: &CalibrationArgs) -> Result<Survey, Failure> {
    let (mut line, name, rigs) = (ProgressLine::shown_if(is_shown()), way.as_str(), args.rigs);
    let progress = |done| line.show(format_args!("{name}: rig {done} of {rigs}"), Instant::now());
    survey(way, rigs, args.seed, progress).map_err(failed_because)
}
