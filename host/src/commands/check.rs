//! `plumb check`: whether a rig file and its camera file are right, and the rig itself.

mod commissioning;
mod options;
mod words;

use plumb_runtime::rig::check::{Severity, SimulationMistake, check};
use plumb_sim::emulator::EmulatedBoard;
use plumb_sim::simulated::check_simulation;
use serde_json::json;

use crate::cli::exit::{Exit, Failure, Work};
use crate::cli::hints::INIT;
use crate::cli::print;

pub(crate) use options::Args;

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
        let jogged = jogs.map(|jogs| jogs(&args)).transpose()?;
        let exit = match (errors, &jogged) {
            (0, Some(jogged)) => Exit::done_if(jogged.is_right),
            (0, None) => Exit::Done,
            _ => Exit::BadInput,
        };
        let mut line = json!({ "errors": errors, "warnings": warnings, "findings": findings });
        if let Some(jogged) = jogged {
            line["rig"] = jogged.line;
        }
        print::json(args.json, line)?;
        Ok(exit)
    }))
}
