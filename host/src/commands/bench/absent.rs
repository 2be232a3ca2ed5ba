//! A program without the benchmarks.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Subcommand;

use super::{Failure, bad_input};

/// Reason to refuse the command.
const ABSENT: &str = "this program was built without the benchmarks; build it with \
                      cargo build --release -p plumb --features bench";

#[derive(Subcommand)]
pub(crate) enum Command {
    #[command(external_subcommand)]
    Any(Vec<OsString>),
}

pub(crate) fn main(command: Command) -> Result<ExitCode, Failure> {
    let Command::Any(_arguments) = command;
    Err(bad_input(ABSENT))
}
