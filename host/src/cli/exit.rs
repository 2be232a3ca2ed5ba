//! The two phases of a command, and its end by an error: what is printed, and the exit code.

use std::env;
use std::error::Error;
use std::ffi::OsString;
use std::fmt;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use clap::error::ErrorKind as HelpKind;
use plumb_config::error_chain::ErrorChain;
use plumb_protocol::message::Refusal;
use plumb_runtime::link::LinkError;
use serde_json::json;
use thiserror::Error;

use crate::cli::hints::hint;
use crate::cli::print::result;

/// Exit code of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// The work is done.
    Done = 0,
    /// The command did its work and did not succeed, or the work had an error: a target is not
    /// reached, a board is silent, a disk is full.
    Failed = 1,
    /// The preparation had an error: an option, a file or a port.
    BadInput = 2,
}

impl Exit {
    /// Returns the exit code of a command that did its work, and succeeded or not.
    pub(crate) fn done_if(is_done: bool) -> Self {
        if is_done { Self::Done } else { Self::Failed }
    }
}

/// The work of a command, which is prepared: the command line, the files and the port are read.
pub(crate) type Work = Box<dyn FnOnce() -> Result<Exit, Failure>>;

/// Prints what is wrong with the command line, or the help that it asks for. Returns the exit code.
pub(crate) fn report_usage(error: &clap::Error) -> Exit {
    if !error.use_stderr() || error.kind() == HelpKind::DisplayHelpOnMissingArgumentOrSubcommand {
        // Help that nobody reads is no failure.
        let _closed_pipe = error.print();
        return if error.use_stderr() { Exit::BadInput } else { Exit::Done };
    }
    let text = error.render().to_string();
    tell!("plumb: {}", text.trim_end());
    print_json(Exit::BadInput, text.trim_end());
    Exit::BadInput
}

/// Error that ends a command.
pub(crate) struct Failure {
    error: Box<dyn Error>,
    /// What to do next, in words; empty where the error says it.
    advice: String,
    /// Whether the command has printed its result in JSON before it failed.
    has_result: bool,
}

/// Mistake in the input that may show only during the work, in words.
#[derive(Debug, Error)]
#[error("{0}")]
struct BadInput(String);

/// Failure to write a file.
#[derive(Debug, Error)]
#[error("{}: cannot be written", path.display())]
pub(crate) struct Unwritten {
    path: PathBuf,
    source: io::Error,
}

impl Unwritten {
    /// Returns the function that makes the failure to write the file at `path` of its cause.
    pub(crate) fn at(path: &Path) -> impl FnOnce(io::Error) -> Self {
        |source| Self { path: path.to_owned(), source }
    }
}

/// Returns the failure of a command in words.
pub(crate) fn failed(message: impl fmt::Display) -> Failure {
    Failure { error: message.to_string().into(), advice: String::new(), has_result: false }
}

/// Returns the failure of a command by a mistake in its input that may show only during the work:
/// in a line of standard input, or by the path of a port.
pub(crate) fn bad_input(message: impl fmt::Display) -> Failure {
    BadInput(message.to_string()).into()
}

impl<E: Error + 'static> From<E> for Failure {
    fn from(error: E) -> Self {
        Self { error: error.into(), advice: String::new(), has_result: false }
    }
}

impl Failure {
    /// Prints the error: for people, and as the line of JSON of a command with `--json` that has
    /// printed no result. Returns the exit code: `phase`, save where the error tells another one.
    pub(crate) fn report(&self, phase: Exit) -> Exit {
        let code = self.code(phase);
        self.print();
        if !self.has_result {
            print_json(code, &self.message());
        }
        code
    }

    /// Returns the exit code of this error in a phase whose own one is `phase`.
    fn code(&self, phase: Exit) -> Exit {
        ErrorChain(&*self.error).errors().find_map(code_of_fact).unwrap_or(phase)
    }

    /// Returns the error, its causes, and what to do next, in words.
    pub(crate) fn message(&self) -> String {
        let mut text = ErrorChain(&*self.error).to_string();
        for next in [hint(&*self.error).unwrap_or_default(), &self.advice] {
            if !next.is_empty() {
                text += if text.ends_with(['.', '?']) { " " } else { ". " };
                text += next;
            }
        }
        text
    }

    /// Returns the failure of a command that has printed its result in JSON.
    pub(crate) fn with_result(self) -> Self {
        Self { has_result: true, ..self }
    }

    /// Returns the failure with `advice` behind its message.
    pub(crate) fn with_advice(self, advice: impl fmt::Display) -> Self {
        Self { advice: advice.to_string(), ..self }
    }

    /// Prints the error, without its consequences.
    pub(crate) fn print(&self) {
        tell!("plumb: {}", self.message());
    }
}

/// Returns the first of two failures, and prints the second.
pub(crate) fn both(first: Result<(), Failure>, second: Result<(), Failure>) -> Result<(), Failure> {
    match (first, second) {
        (Err(first), Err(second)) => {
            second.print();
            Err(first)
        }
        (first, second) => first.and(second),
    }
}

/// Returns the exit code of an error that is no matter of the phase: that of the link to a board,
/// of a write without room (a full disk, or a limit of the size), or of an input during the work.
fn code_of_fact(error: &(dyn Error + 'static)) -> Option<Exit> {
    use ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    if let Some(error) = error.downcast_ref::<io::Error>() {
        let is_without_room = matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge);
        return is_without_room.then_some(Exit::Failed);
    }
    if error.is::<BadInput>() {
        return Some(Exit::BadInput);
    }
    Some(match error.downcast_ref()? {
        LinkError::Absent { .. }
        | LinkError::Busy { .. }
        | LinkError::Permission { .. }
        | LinkError::NotAPort { .. }
        | LinkError::Open { .. }
        | LinkError::Ports { .. }
        | LinkError::Refused { refusal: Refusal::Config(_), .. } => Exit::BadInput,
        _ => Exit::Failed,
    })
}

/// Prints an error as a line of JSON where the command line asks for JSON.
fn print_json(code: Exit, message: &str) {
    if is_json_asked(env::args_os().skip(1)) {
        // The exit code tells the error, also where standard output cannot be written.
        let _unwritten = result(json!({ "error": message, "exit_code": code as u8 }));
    }
}

/// Returns whether the command with these arguments ends with a line of JSON: the option `--json`,
/// or the command `demo`. Also for a command line that cannot be parsed.
fn is_json_asked(arguments: impl Iterator<Item = OsString>) -> bool {
    let options: Vec<OsString> = arguments.take_while(|argument| argument != "--").collect();
    options.first().is_some_and(|command| command == "demo")
        || options.iter().any(|option| option == "--json")
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use plumb_log::RunLogError;
    use plumb_protocol::message::ConfigField;
    use plumb_runtime::link::Damage;
    use plumb_runtime::run::RunError;

    use super::*;

    /// Returns the exit codes of an error of the preparation and of one of the work.
    fn codes(error: impl Error + 'static) -> [Exit; 2] {
        let failure = Failure::from(error);
        [Exit::BadInput, Exit::Failed].map(|phase| failure.code(phase))
    }

    #[test]
    fn the_code_of_a_board_and_of_a_write_without_room_is_that_of_every_phase() {
        let refusal = Refusal::Config(ConfigField::Travel);
        let refused = || LinkError::Refused { what: "the configuration", refusal };
        assert_eq!(codes(refused()), [Exit::BadInput; 2]);
        assert_eq!(codes(RunError::Connect(refused())), [Exit::BadInput; 2]);
        assert_eq!(codes(LinkError::Absent { port: "port".to_owned() }), [Exit::BadInput; 2]);
        let silent = LinkError::Silent {
            port: "port".to_owned(),
            what: "the greeting",
            waited: Duration::from_secs(1),
            damage: Damage::default(),
        };
        assert_eq!(codes(RunError::Connect(silent)), [Exit::Failed; 2]);
        for kind in [ErrorKind::StorageFull, ErrorKind::QuotaExceeded, ErrorKind::FileTooLarge] {
            let log = RunLogError::Io { action: "write", path: "run".into(), source: kind.into() };
            assert_eq!(codes(log), [Exit::Failed; 2], "{kind}");
        }
    }

    #[test]
    fn the_code_of_any_other_error_is_that_of_its_phase() {
        assert_eq!(codes(RunError::NoTargets), [Exit::BadInput, Exit::Failed]);
        assert_eq!(codes(io::Error::from(ErrorKind::NotFound)), [Exit::BadInput, Exit::Failed]);
    }

    #[test]
    fn what_to_do_next_stands_behind_the_error() {
        let message = |text| failed(text).with_advice("Then this").message();
        assert_eq!(message("it broke"), "it broke. Then this");
        assert_eq!(message("is it on?"), "is it on? Then this");
    }

    #[test]
    fn json_is_asked_for_by_an_option_or_by_the_demo() {
        let asked = |line: &str| is_json_asked(line.split(' ').map(OsString::from));
        assert!(asked("run --json") && asked("--json") && asked("demo --law sign"));
        assert!(!asked("run demo") && !asked("run -- --json"));
    }
}
