//! `plumb check`: whether a rig file and its camera file are right.

use std::process::ExitCode;

use clap::Parser;
use plumb_runtime::rig::check::{Finding, Severity, check};
use plumb_sim::emulator::EmulatedBoard;
use serde::Serialize;

use super::exit::BAD_INPUT;
use super::print::tell;
use super::rig_args::RigArg;
use super::{Failure, print};

/// Check a rig file and its camera file: every mistake at once, without a board
///
/// An error is what a run refuses. A warning is about a file that a run accepts, but that protects
/// the rig badly. Exit code 2 where there is an error.
#[derive(Parser)]
#[command(after_help = examples!["plumb check rig.toml --file-only"])]
pub(crate) struct Args {
    #[command(flatten)]
    rig: RigArg,
    /// Check the files only: no board, no camera, nothing moves
    #[arg(long, required = true)]
    file_only: bool,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Line of JSON.
#[derive(Serialize)]
struct Line<'a> {
    errors: usize,
    warnings: usize,
    findings: &'a [Finding],
}

pub(crate) fn main(args: Args) -> Result<ExitCode, Failure> {
    let findings = check(&args.rig.rig, &EmulatedBoard::config_errors);
    for finding in &findings {
        tell!("{finding}");
    }
    let count = |severity| findings.iter().filter(|finding| finding.severity == severity).count();
    let (errors, warnings) = (count(Severity::Error), count(Severity::Warning));
    let plural = |count| if count == 1 { "" } else { "s" };
    tell!(
        "{}: {errors} error{}, {warnings} warning{}",
        args.rig.rig.display(),
        plural(errors),
        plural(warnings)
    );
    if args.json {
        let line = Line { errors, warnings, findings: &findings };
        print::result(serde_json::to_string(&line)?)?;
    }
    Ok(if errors == 0 { ExitCode::SUCCESS } else { ExitCode::from(BAD_INPUT) })
}
