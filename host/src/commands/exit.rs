//! The end of a command by an error: what is printed, and the exit code.

mod class;

use std::env;
use std::error::Error;
use std::ffi::OsString;
use std::fmt;
use std::io::{self, ErrorKind};
use std::path::Path;
use std::process::ExitCode;

use clap::error::ErrorKind as HelpKind;
use plumb_config::error_chain::ErrorChain;
use serde_json::json;
use thiserror::Error;

use super::print::{result, tell};
use super::rig_args::PORT_VARIABLE;
use super::rig_path::RIG_VARIABLE;

pub(crate) use class::{BAD_INPUT, ExitClass, FAILED, INIT, exit_code_of};

/// Prints what is wrong with the command line, or the help that it asks for. Returns the exit code.
pub(crate) fn report_usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() || error.kind() == HelpKind::DisplayHelpOnMissingArgumentOrSubcommand {
        // Help that nobody reads is no failure.
        let _closed_pipe = error.print();
        return ExitCode::from(if error.use_stderr() { BAD_INPUT } else { 0 });
    }
    let text = error.render().to_string();
    tell!("plumb: {}", text.trim_end());
    print_json(BAD_INPUT, text.trim_end());
    ExitCode::from(BAD_INPUT)
}

/// Error that ends a command, and its exit code.
pub(crate) struct Failure {
    code: u8,
    error: Box<dyn Error>,
    /// Whether the command has printed its result in JSON before it failed.
    has_result: bool,
}

/// Mistake in the input, in words.
#[derive(Debug, Error)]
#[error("{0}")]
struct InputError(String);

/// Failure of a command, in words.
#[derive(Debug, Error)]
#[error("{0}")]
struct CommandError(String);

exit_code_of! { BAD_INPUT: InputError }
exit_code_of! { FAILED: CommandError }

/// Returns the failure of a command for a mistake in its input.
pub(crate) fn bad_input(message: impl fmt::Display) -> Failure {
    InputError(message.to_string()).into()
}

/// Returns the failure of a command that could not do its work.
pub(crate) fn failed(message: impl fmt::Display) -> Failure {
    CommandError(message.to_string()).into()
}

/// Returns the failure to write the file at `path`, with the exit code of the `error`.
pub(crate) fn unwritten(path: &Path, error: &io::Error) -> Failure {
    let message = format!("{}: cannot be written: {}", path.display(), ErrorChain(error));
    if class::file_exit_code(error) == BAD_INPUT { bad_input(message) } else { failed(message) }
}

/// Returns the failure of a command because of an error that is no mistake in its input.
pub(crate) fn failed_because(error: impl Error + 'static) -> Failure {
    Failure { code: FAILED, error: error.into(), has_result: false }
}

impl<E: ExitClass + 'static> From<E> for Failure {
    fn from(error: E) -> Self {
        let is_without_room = ErrorChain(&error).errors().any(is_without_room);
        let code = if is_without_room { FAILED } else { error.exit_code() };
        let advice = error.advice();
        let failure = Self { code, error: error.into(), has_result: false };
        match advice {
            Some(advice) => failure.with_advice(advice),
            None => failure,
        }
    }
}

impl Failure {
    /// Prints the error: for people, and as the line of JSON of a command with `--json` that has
    /// printed no result. Returns the exit code.
    pub(crate) fn report(&self) -> ExitCode {
        self.print();
        if !self.has_result {
            print_json(self.code, &self.message());
        }
        ExitCode::from(self.code)
    }

    /// Returns the error and its causes in words.
    pub(crate) fn message(&self) -> String {
        let message = ErrorChain(&*self.error).to_string();
        match variables_that_name_file(&message) {
            Some((variables, path)) => {
                message.replacen(&path, &format!("{path} (named by {variables})"), 1)
            }
            None => message,
        }
    }

    /// Returns the failure of a command that has printed its result in JSON.
    pub(crate) fn with_result(self) -> Self {
        Self { has_result: true, ..self }
    }

    /// Returns the failure with `advice` behind its message.
    pub(crate) fn with_advice(self, advice: impl fmt::Display) -> Self {
        let error = ErrorChain(&*self.error).to_string();
        let end = if error.ends_with('?') { "" } else { "." };
        let message = format!("{error}{end} {advice}");
        Self { error: CommandError(message).into(), ..self }
    }

    /// Prints the error, without its consequences.
    pub(crate) fn print(&self) {
        tell!("plumb: {}", self.message());
    }
}

/// Returns a file's path for a message, with the environment variables that name it where no word
/// of the command line does.
pub(crate) fn with_variable(path: &Path) -> String {
    let path = path.display();
    match variables_that_name_file(&format!("{path}: ")) {
        Some((variables, _)) => format!("{path} (named by {variables})"),
        None => path.to_string(),
    }
}

/// Returns the environment variables that have the path with which an error begins, and the path,
/// where no word of the command line is that path. Both may have it: the error does not tell which
/// of them it is about. `plumb init` names its files itself.
fn variables_that_name_file(message: &str) -> Option<(String, String)> {
    if env::args_os().nth(1).is_some_and(|command| command == "init") {
        return None;
    }
    let named = |variable| {
        let path = env::var(variable).ok().filter(|path| !path.is_empty())?;
        let begins = message.starts_with(&format!("{path}: "));
        let is_alone = begins && env::args_os().skip(2).all(|word| word != path.as_str());
        is_alone.then_some((variable, path))
    };
    let mut named = [RIG_VARIABLE, PORT_VARIABLE].into_iter().filter_map(named);
    let (variable, path) = named.next()?;
    match named.find(|(_, other)| *other == path) {
        Some((other, _)) => Some((format!("{variable} and {other}"), path)),
        None => Some((variable.to_owned(), path)),
    }
}

/// Prints an error as a line of JSON where the command line asks for JSON.
fn print_json(code: u8, message: &str) {
    if is_json_asked(env::args_os().skip(1)) {
        // The exit code tells the error, also where standard output cannot be written.
        let _unwritten = result(json!({ "error": message, "exit_code": code }));
    }
}

/// Returns whether the command with these arguments ends with a line of JSON: the option `--json`,
/// or the command `demo`. Also for a command line that cannot be parsed.
fn is_json_asked(arguments: impl Iterator<Item = OsString>) -> bool {
    let options: Vec<OsString> = arguments.take_while(|argument| argument != "--").collect();
    options.first().is_some_and(|command| command == "demo")
        || options.iter().any(|option| option == "--json")
}

/// Returns whether `error` is that of a write without room: a full disk, or a limit of the size.
fn is_without_room(error: &(dyn Error + 'static)) -> bool {
    let kind = error.downcast_ref::<io::Error>().map(io::Error::kind);
    matches!(
        kind,
        Some(ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge)
    )
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use plumb_cameras::png::PngError;
    use plumb_cameras::record::RecordError;
    use plumb_log::RunLogError;
    use plumb_protocol::message::{ConfigField, Refusal};
    use plumb_runtime::link::{Damage, LinkError};
    use plumb_runtime::run::RunError;
    use plumb_sim::emulator::serve::ServeError;

    use super::*;

    fn silent() -> LinkError {
        let waited = Duration::from_secs(1);
        LinkError::Silent {
            port: "port".to_owned(),
            what: "the greeting",
            waited,
            damage: Damage::default(),
        }
    }

    fn code(error: impl ExitClass + 'static) -> u8 {
        Failure::from(error).code
    }

    #[test]
    fn a_silent_board_is_the_same_failure_for_every_command() {
        assert_eq!([code(silent()), code(RunError::Connect(silent()))], [FAILED; 2]);
    }

    #[test]
    fn mistakes_in_the_input_are_told_from_failures() {
        let refusal = Refusal::Config(ConfigField::Travel);
        let refused = || LinkError::Refused { what: "the configuration", refusal };
        let absent = LinkError::Absent { port: "port".to_owned() };
        assert_eq!(code(refused()), BAD_INPUT);
        assert_eq!(code(RunError::Connect(refused())), BAD_INPUT);
        assert_eq!(code(absent), BAD_INPUT);
        assert_eq!(code(RunError::NoTargets), BAD_INPUT);
        assert_eq!(code(RunLogError::Exists("run".into())), BAD_INPUT);
        assert_eq!(bad_input("an option").code, BAD_INPUT);
        assert_eq!(code(io::Error::other("a full disk")), FAILED);
        assert_eq!(code(RecordError::Thread), FAILED);
        let hung_up = io::Error::other("hung up");
        assert_eq!(code(ServeError::Terminal(hung_up)), FAILED);
        assert_eq!(failed("a full disk").code, FAILED);
    }

    #[test]
    fn json_is_asked_for_by_an_option_or_by_the_demo() {
        let asked = |line: &str| is_json_asked(line.split(' ').map(OsString::from));
        assert!(asked("run --json") && asked("--json") && asked("demo --law sign"));
        assert!(!asked("run demo") && !asked("run -- --json"));
    }

    #[test]
    fn a_full_disk_is_a_failure_and_a_path_that_cannot_be_created_is_bad_input() {
        let codes = |kind: ErrorKind| {
            let log = RunLogError::Io { action: "write", path: "run".into(), source: kind.into() };
            let error = kind.into();
            [code(log), code(RecordError::Io { action: "write", path: "run".into(), error })]
        };
        for kind in [ErrorKind::StorageFull, ErrorKind::QuotaExceeded, ErrorKind::FileTooLarge] {
            assert_eq!(codes(kind), [FAILED; 2], "{kind}");
            let png = PngError::Write { path: "1.png".into(), source: kind.into() };
            assert_eq!(code(png), FAILED, "{kind}");
        }
        for kind in [ErrorKind::NotFound, ErrorKind::PermissionDenied, ErrorKind::NotADirectory] {
            assert_eq!(codes(kind), [BAD_INPUT; 2], "{kind}");
        }
    }
}
