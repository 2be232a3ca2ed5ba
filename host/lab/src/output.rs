//! Output: results to standard output, progress and errors to standard error.

use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write, stderr, stdout};
use std::process::{ExitCode, exit};
use std::time::{Duration, Instant};

use plumb_bench::control::BenchError;
use plumb_config::error_chain::ErrorChain;
use plumb_config::escape::escaped;
use plumb_frame::source::BoxedError;
use serde::Serialize;
use serde_json::json;

/// Exit code of work that failed.
pub(crate) const FAILED: u8 = 1;

/// Exit code for a mistake in the input: an option or a file.
pub(crate) const BAD_INPUT: u8 = 2;

/// Error that ends the program, and its exit code.
pub(crate) struct Failure {
    code: u8,
    error: BoxedError,
}

/// Returns the failure for a mistake in the input.
pub(crate) fn bad_input(error: impl Into<BoxedError>) -> Failure {
    Failure { code: BAD_INPUT, error: error.into() }
}

/// Returns the failure of work that could not be done.
pub(crate) fn failed(error: impl Into<BoxedError>) -> Failure {
    Failure { code: FAILED, error: error.into() }
}

impl From<BenchError> for Failure {
    fn from(error: BenchError) -> Self {
        match error {
            BenchError::Range(_) | BenchError::Config(_) | BenchError::Unsuitable { .. } => {
                bad_input(error)
            }
            _ => failed(error),
        }
    }
}

impl Failure {
    /// Prints the error with its causes. Returns the exit code.
    pub(crate) fn report(&self) -> ExitCode {
        let message = ErrorChain(&*self.error).to_string();
        tell!("plumb-lab: {}", escaped(&message));
        print_error(self.code, &message);
        ExitCode::from(self.code)
    }
}

/// Prints an error as a line of JSON where the command line asks for JSON.
pub(crate) fn print_error(code: u8, message: &str) {
    if std::env::args_os().any(|word| word == "--json") {
        // The exit code tells the error, also where standard output cannot be written.
        let _unwritten = print(&json!({ "error": message, "exit_code": code }));
    }
}

/// Prints a result as a line of JSON. Ends the program where its reader has gone.
pub(crate) fn print(result: &impl Serialize) -> Result<(), Failure> {
    let line = serde_json::to_string(result).map_err(failed)? + "\n";
    stdout().write_all(line.as_bytes()).and_then(|()| stdout().flush()).map_err(|error| {
        if error.kind() == ErrorKind::BrokenPipe {
            exit(0);
        }
        failed(format!("standard output: cannot be written: {}", ErrorChain(&error)))
    })
}

/// Returns what shows on a terminal how many of the rigs of `name` are done, ten times a second.
pub(crate) fn progress(name: impl Display, rigs: u64) -> impl FnMut(u64) {
    let mut shown: Option<Instant> = None;
    move |done| {
        let is_new = shown.is_some_and(|shown| shown.elapsed() < Duration::from_millis(100));
        let is_last = done == rigs;
        if stderr().is_terminal() && (is_last || !is_new) {
            let text =
                if is_last { String::new() } else { format!("{name}: rig {done} of {rigs}") };
            let _lost = write!(stderr(), "\r\x1b[2K{text}");
            shown = Some(Instant::now());
        }
    }
}
