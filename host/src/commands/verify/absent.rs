//! A program without the proofs.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;

use super::{Failure, bad_input};

/// Reason to refuse the command.
const ABSENT: &str = "this program was built without the proofs; build it with \
                      cargo build --release -p plumb --features verify";

/// Proofs about the control laws, for a family of rigs or for a family of Jacobians
#[derive(Parser)]
#[command(disable_help_flag = true)]
pub(crate) struct Args {
    /// Arguments of the command
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    _arguments: Vec<OsString>,
}

pub(crate) fn main(_: Args) -> Result<ExitCode, Failure> {
    Err(bad_input(ABSENT))
}
