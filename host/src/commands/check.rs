//! `plumb check`: whether a rig file and its camera file are right, and the rig itself.

mod commissioning;
mod words;

use std::process::ExitCode;

use clap::Parser;
use plumb_runtime::rig::check::{Finding, Severity, SimulationMistake, check};
use plumb_sim::emulator::EmulatedBoard;
use plumb_sim::simulated::check_simulation;
use serde::Serialize;

use crate::cli::choices::{DetectorName, Physics};
use crate::cli::exit::{BAD_INPUT, FAILED, Failure, Work};
use crate::cli::hints::INIT;
use crate::cli::port_args::PortArgs;
use crate::cli::print::{self, note, tell};
use crate::cli::rig_path::RigArg;
use commissioning::RigLine;

/// Check a rig: its files, then its wiring, cables and camera with small jogs
///
/// The files come first: every mistake at once. Then each motor turns a little, one after the other
/// and back, and the camera watches the ball. The command names swapped and reversed motors, a
/// motor that does not turn, slack and slipping cables, and a camera's pose that is turned or
/// mirrored, and offers the corrected rig file. Nothing moves before a yes.
///
/// Exit code 0 where nothing is wrong, 1 where the rig has a fault, 2 where a file has an error.
#[derive(Parser)]
#[command(
    after_help = examples![
        "plumb check --file-only",
        "plumb check",
        "plumb check --rig trial/rig.toml --yes --json",
    ]
)]
pub(crate) struct Args {
    #[command(flatten)]
    rig: RigArg,
    /// Check the files only: no board, no camera, nothing moves
    #[arg(long)]
    file_only: bool,
    #[command(flatten)]
    port: PortArgs,
    /// Detector of the ball
    #[arg(long, value_enum, default_value = "ball")]
    detector: DetectorName,
    /// Physics of the simulated rig, where the camera is simulated
    #[arg(long, value_enum, default_value = "quasi-static")]
    physics: Physics,
    /// Turn the motors and write the corrected rig file without asking
    #[arg(long)]
    yes: bool,
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
    /// Result of the jogs; absent with `--file-only` and where a file has an error.
    #[serde(skip_serializing_if = "Option::is_none")]
    rig: Option<RigLine>,
}

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    let file = args.rig.needed()?;
    let findings = check(&file, &EmulatedBoard::refusals, &|rig, simulation, camera| {
        check_simulation(rig, simulation, camera).map_err(SimulationMistake::from)
    });
    for finding in &findings {
        tell!("{finding}");
    }
    let count = |severity| findings.iter().filter(|finding| finding.severity == severity).count();
    let (errors, warnings) = (count(Severity::Error), count(Severity::Warning));
    let plural = |count| if count == 1 { "" } else { "s" };
    let (name, ends) = (file.display(), [errors, warnings].map(plural));
    let count = format!("{name}: {errors} error{}, {warnings} warning{}", ends[0], ends[1]);
    match findings.is_empty() {
        true => note!("{count}"),
        false => tell!("{count}"),
    }
    if matches!(file.try_exists(), Ok(false)) {
        tell!("{INIT}");
    }
    let jogs = match (errors, args.file_only) {
        (0, false) => Some(commissioning::prepare(&args, file)?),
        _ => None,
    };
    Ok(Box::new(move || {
        let rig = jogs.map(|jogs| jogs(&args)).transpose()?;
        let code = match (errors, &rig) {
            (0, Some(rig)) if !rig.right => FAILED,
            (0, _) => 0,
            _ => BAD_INPUT,
        };
        if args.json {
            let line = Line { errors, warnings, findings: &findings, rig };
            print::result(serde_json::to_string(&line)?)?;
        }
        Ok(ExitCode::from(code))
    }))
}
