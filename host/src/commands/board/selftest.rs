//! `plumb board selftest`: tests the chip of a board without a rig.

use std::path::PathBuf;

use clap::Parser;
use plumb_protocol::RELEASE;
use plumb_runtime::link::Link;
use plumb_runtime::rig::BoardName;
use plumb_setup::selftest::{self, Check, Outcome};
use serde_json::json;

use super::status::{chip_counts, firmware_line};
use crate::cli::exit::{Exit, Failure, Work, failed};
use crate::cli::old_file::{ask, write};
use crate::cli::port_args::BoardArgs;
use crate::cli::print;

#[derive(Parser)]
pub(super) struct Args {
    #[command(flatten)]
    board: BoardArgs,
    /// Kind of the board, whose STEP and DIR pins are tested [default: that of the rig file; pico
    /// without one]
    #[arg(long, value_enum, ignore_case = true)]
    kind: Option<BoardName>,
    /// The motors' supply is off: do not ask
    #[arg(long)]
    yes: bool,
    /// File for the results, to attach to a report
    #[arg(long, value_name = "FILE", default_value = "plumb-selftest.json")]
    out: PathBuf,
}

pub(super) fn prepare(args: Args) -> Result<Work, Failure> {
    let kind = kind(&args)?;
    // A board that does not answer makes the question needless.
    Link::connect(args.board.open()?)?;
    Ok(Box::new(move || test(&args, kind)))
}

/// Tests the board, if the user agrees or has agreed.
fn test(args: &Args, kind: BoardName) -> Result<Exit, Failure> {
    let pins = kind.board().name;
    let question =
        format!("The pins of board.kind = \"{pins}\" will give pulses. Is the motors' supply off?");
    if !args.yes && !ask(&question)? {
        return Err(failed("nothing was tested: switch the motors' supply off first"));
    }
    let mut link = Link::connect(args.board.open()?)?;
    let (port, provenance) = (link.port(), link.provenance()?);
    tell!("{port}: {provenance}; the pins are those of board.kind = \"{pins}\"");
    let checks = selftest::run(&mut link, kind, print_check)?;
    let failed = checks.iter().filter(|check| check.outcome == Outcome::Failed).count();
    let report = json!({
        "plumb": RELEASE.to_string(),
        "firmware": firmware_line(&provenance),
        "checks": checks,
        "failed": failed,
        "counts": chip_counts(&link.diagnostics()?),
    });
    write(&args.out, format!("{report:#}\n").as_bytes())?;
    tell!(
        "{port}: {failed} of {} checks failed; {} has the results",
        checks.len(),
        args.out.display()
    );
    print::json(args.board.json, report)?;
    Ok(Exit::done_if(failed == 0))
}

/// Returns the kind of the board: of the option, or of the rig file. A Pico without both.
fn kind(args: &Args) -> Result<BoardName, Failure> {
    match args.kind {
        Some(kind) => Ok(kind),
        None => Ok(args.board.kind()?.unwrap_or_default()),
    }
}

/// Prints a check for people.
fn print_check(check: &Check) {
    let outcome = match check.outcome {
        Outcome::Passed => "passed",
        Outcome::Failed => "FAILED",
        Outcome::NotMeasured => "not measured",
    };
    tell!("{outcome}: {} ({})", check.check, check.measured);
}
