//! The end of a command by a mistake in its command line.

use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};

use super::{BAD_INPUT, Failure, bad_input};
use crate::commands::print::tell;
use crate::commands::rig_args::no_rig;

/// Prints what is wrong with the command line, or the help that it asks for. Returns the exit code.
pub(crate) fn report_usage(error: &clap::Error) -> ExitCode {
    if let Some(failure) = missing_rig(error) {
        return failure.report();
    }
    if !error.use_stderr() || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        // Help that nobody reads is no failure.
        let _closed_pipe = error.print();
        return ExitCode::from(if error.use_stderr() { BAD_INPUT } else { 0 });
    }
    let UsageError { usage, message } = UsageError::of(&error.render().to_string());
    if !usage.is_empty() {
        tell!("{usage}");
    }
    bad_input(message).report()
}

/// Error of the command line, in the program's own words.
struct UsageError {
    /// Usage of the command; empty where there is none.
    usage: String,
    /// Description in one line.
    message: String,
}

impl UsageError {
    /// Takes the text of the parser apart. Its advice to pass an unknown option as a value is left
    /// out: no command has such values.
    fn of(text: &str) -> Self {
        let (mut usage, mut message) = (String::new(), String::new());
        for part in text.split("\n\n").map(str::trim) {
            let words = part.split_whitespace().collect::<Vec<_>>().join(" ");
            if part.starts_with("Usage:") {
                part.clone_into(&mut usage);
            } else if let Some(error) = words.strip_prefix("error: ") {
                error.clone_into(&mut message);
            } else {
                let tips = part.lines().filter_map(|line| line.trim().strip_prefix("tip: "));
                let tips = tips.filter(|tip| !tip.starts_with("to pass "));
                tips.for_each(|tip| message.push_str(&format!("; {tip}")));
            }
        }
        Self { usage, message }
    }
}

/// Returns the failure of a command line without the rig file that its command needs.
fn missing_rig(error: &clap::Error) -> Option<Failure> {
    let ContextValue::Strings(names) = error.get(ContextKind::InvalidArg)? else { return None };
    let is_rig = |name: &&String| *name == "<RIG>";
    let is_missing = error.kind() == ErrorKind::MissingRequiredArgument;
    names.iter().find(is_rig).filter(|_| is_missing)?;
    let others = names.iter().filter(|name| !is_rig(name));
    let others: String = others.map(|name| format!("; {name} is missing too")).collect();
    let usage = error.get(ContextKind::Usage).map(ContextValue::to_string).unwrap_or_default();
    Some(no_rig(&others, usage.trim_start_matches("Usage: ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_of_the_command_line_is_one_line_with_its_tip_and_without_a_useless_one() {
        let text = "error: unexpected argument '--pag' found\n\n  tip: a similar argument exists: \
                    '--page'\n  tip: to pass '--pag' as a value, use '-- --pag'\n\nUsage: plumb \
                    run [OPTIONS] [RIG]\n\nFor more information, try '--help'.\n";
        let UsageError { usage, message } = UsageError::of(text);
        assert_eq!(usage, "Usage: plumb run [OPTIONS] [RIG]");
        let expected = "unexpected argument '--pag' found; a similar argument exists: '--page'";
        assert_eq!(message, expected);
        let text = "error: invalid value 'x' for '--law <LAW>'\n  [possible values: a, b]\n\nFor \
                    more information, try '--help'.\n";
        let message = UsageError::of(text).message;
        assert_eq!(message, "invalid value 'x' for '--law <LAW>' [possible values: a, b]");
    }
}
