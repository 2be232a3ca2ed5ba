//! The end of a command by a mistake in its command line.

use std::process::ExitCode;

use clap::error::ErrorKind;

use super::suggestions::{choice, similar};
use super::{BAD_INPUT, bad_input};
use crate::commands::command_line;
use crate::commands::print::tell;

/// Prints what is wrong with the command line, or the help that it asks for. Returns the exit code.
pub(crate) fn report_usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        // Help that nobody reads is no failure.
        let _closed_pipe = error.print();
        return ExitCode::from(if error.use_stderr() { BAD_INPUT } else { 0 });
    }
    let words: Vec<String> =
        command_line().iter().map(|word| word.to_string_lossy().into()).collect();
    let UsageError { usage, message, tips } = UsageError::of(&error.render().to_string());
    if !usage.is_empty() {
        tell!("{usage}");
    }
    let hint = similar(error).or_else(|| choice(error, &words));
    let hint = hint.map(|hint| format!("; {hint}")).unwrap_or_default();
    let tips = if hint.is_empty() { tips } else { String::new() };
    bad_input(format!("{message}{hint}{tips}")).report()
}

/// Error of the command line, in the program's own words.
struct UsageError {
    /// Usage of the command; empty where there is none.
    usage: String,
    /// Description in one line.
    message: String,
    /// Advice of the parser, each behind a semicolon.
    tips: String,
}

impl UsageError {
    /// Takes the text of the parser apart. Its similar words are left out, as [`similar`] chooses
    /// them, and its advice to pass an unknown option as a value: no command has such values.
    fn of(text: &str) -> Self {
        let [mut usage, mut message, mut advice] = [const { String::new() }; 3];
        for part in text.split("\n\n").map(str::trim) {
            let words = part.split_whitespace().collect::<Vec<_>>().join(" ");
            if part.starts_with("Usage:") {
                part.clone_into(&mut usage);
            } else if let Some(error) = words.strip_prefix("error: ") {
                error.clone_into(&mut message);
            } else {
                let tips = part.lines().filter_map(|line| line.trim().strip_prefix("tip: "));
                let tips = tips.filter(|tip| !tip.starts_with("to pass "));
                let tips = tips.filter(|tip| !tip.contains(" similar "));
                tips.for_each(|tip| advice.push_str(&format!("; {tip}")));
            }
        }
        Self { usage, message, tips: advice }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_of_the_command_line_is_one_line_without_useless_tips() {
        let text = "error: unexpected argument '--pag' found\n\n  tip: a similar argument exists: \
                    '--page'\n  tip: to pass '--pag' as a value, use '-- --pag'\n\nUsage: plumb \
                    run [OPTIONS]\n\nFor more information, try '--help'.\n";
        let UsageError { usage, message, tips } = UsageError::of(text);
        assert_eq!(usage, "Usage: plumb run [OPTIONS]");
        assert_eq!(message, "unexpected argument '--pag' found");
        assert_eq!(tips, "");
        let text = "error: invalid value 'x' for '--law <LAW>'\n  [possible values: a, b]\n\nFor \
                    more information, try '--help'.\n";
        let message = UsageError::of(text).message;
        assert_eq!(message, "invalid value 'x' for '--law <LAW>' [possible values: a, b]");
    }
}
