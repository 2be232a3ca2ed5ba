//! `plumb check`: whether a rig file and its camera file are right, and the rig itself.

mod commissioning;
mod options;
mod words;

use plumb_runtime::rig::check::{Finding, Severity, SimulationMistake, check};
use plumb_sim::emulator::EmulatedBoard;
use plumb_sim::simulated::check_simulation;
use serde::Serialize;

use crate::cli::exit::{Exit, Failure, Work};
use crate::cli::hints::INIT;
use crate::cli::print;
use commissioning::RigLine;

pub(crate) use options::Args;

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
        let exit = match (errors, &rig) {
            (0, Some(rig)) if !rig.right => Exit::Failed,
            (0, _) => Exit::Done,
            _ => Exit::BadInput,
        };
        print::json(args.json, Line { errors, warnings, findings: &findings, rig })?;
        Ok(exit)
    }))
}
