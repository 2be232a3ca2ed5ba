//! The end of a command by a mistake in its command line.

use std::env;
use std::process::ExitCode;
use std::str::FromStr;

use clap::CommandFactory;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use plumb_path::shape::ShapeKind;

use super::{BAD_INPUT, Failure, bad_input};
use crate::commands::print::tell;
use crate::commands::rig_args::{DRIVES_THROUGH_LIST, RIG_VARIABLE, is_file_name, is_list, no_rig};

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
    let UsageError { usage, message, tips } = UsageError::of(&error.render().to_string());
    if !usage.is_empty() {
        tell!("{usage}");
    }
    let hint = unexpected_word(error).and_then(|word| {
        let words: Vec<String> = env::args_os().map(|it| it.to_string_lossy().into()).collect();
        hint(word, &words)
    });
    let hint = hint.or_else(|| unknown_command(error).and_then(command_hint));
    // A similar word is a guess.
    let advice = hint.map_or(tips, |hint| format!("; {hint}"));
    bad_input(format!("{message}{advice}")).report()
}

/// Error of the command line, in the program's own words.
struct UsageError {
    /// Usage of the command; empty where there is none.
    usage: String,
    /// Description in one line.
    message: String,
    /// Words that are similar, each behind a semicolon.
    tips: String,
}

impl UsageError {
    /// Takes the text of the parser apart. Its advice to pass an unknown option as a value is left
    /// out: no command has such values.
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
                tips.for_each(|tip| advice.push_str(&format!("; {tip}")));
            }
        }
        Self { usage, message, tips: advice }
    }
}

/// Returns the word that the command must not have; `None` for another mistake.
fn unexpected_word(error: &clap::Error) -> Option<&str> {
    match error.get(ContextKind::InvalidArg)? {
        ContextValue::String(word) if error.kind() == ErrorKind::UnknownArgument => Some(word),
        _ => None,
    }
}

/// Returns the word that is no command; `None` for another mistake.
fn unknown_command(error: &clap::Error) -> Option<&str> {
    match error.get(ContextKind::InvalidSubcommand)? {
        ContextValue::String(word) => Some(word),
        _ => None,
    }
}

/// Returns what to write in place of `word`, where a command below another one has this name, or a
/// file or a shape.
fn command_hint(word: &str) -> Option<String> {
    let cli = crate::Cli::command();
    let mut groups = cli.get_subcommands();
    if let Some(group) = groups.find(|group| group.find_subcommand(word).is_some()) {
        Some(format!("write `plumb {} {word}`", group.get_name()))
    } else if is_list(word) {
        Some(format!("for a list of places: {DRIVES_THROUGH_LIST}"))
    } else if ShapeKind::from_str(word).is_ok() {
        Some(format!("for a shape: `plumb run RIG --path {word}`"))
    } else if is_file_name(word) {
        Some(format!("a command comes first: `plumb run {word}`"))
    } else {
        None
    }
}

/// Returns what to write in place of `word`, which the command line `words` must not have.
fn hint(word: &str, words: &[String]) -> Option<String> {
    let command = words.iter().skip(1).find(|it| !it.starts_with('-'));
    let command = command.map(String::as_str).unwrap_or_default();
    let is_number =
        |word: &str| word.trim_matches(',').split(',').all(|number| number.parse::<f64>().is_ok());
    let mut pairs = words.windows(2);
    if word == "--rig" && command != "demo" {
        Some(format!("the rig file has no option: put it first, or set {RIG_VARIABLE}"))
    } else if is_number(word) && pairs.any(|pair| is_number(&pair[0]) && pair[1].starts_with(word))
    {
        Some("several numbers of an option stand without spaces: 0.4,0.2,0.15".to_owned())
    } else {
        aim_hint(word, is_number(word), command)
    }
}

/// Returns how the aim `word`, a place, a shape or a list of places, is given to `command`; `None`
/// for another word, and for a command that drives to no such aim.
fn aim_hint(word: &str, is_number: bool, command: &str) -> Option<String> {
    let is_shape = ShapeKind::from_str(word).is_ok();
    match command {
        "run" | "demo" if is_shape => Some(format!("for a shape: --path {word}")),
        "run" if is_list(word) => Some(format!("for a list of places: {DRIVES_THROUGH_LIST}")),
        "demo" if is_list(word) => Some(format!("for a list of places: --path {word}")),
        "run" if is_number => Some("to go to one place: `plumb goto RIG 0.4 0.2 0.15`".to_owned()),
        _ => None,
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
        let UsageError { usage, message, tips } = UsageError::of(text);
        assert_eq!(usage, "Usage: plumb run [OPTIONS] [RIG]");
        assert_eq!(message, "unexpected argument '--pag' found");
        assert_eq!(tips, "; a similar argument exists: '--page'");
        let text = "error: invalid value 'x' for '--law <LAW>'\n  [possible values: a, b]\n\nFor \
                    more information, try '--help'.\n";
        let message = UsageError::of(text).message;
        assert_eq!(message, "invalid value 'x' for '--law <LAW>' [possible values: a, b]");
    }

    #[test]
    fn a_word_too_many_is_answered_with_what_to_write() {
        let hint = |word: &str, line: &str| {
            let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
            hint(word, &words).unwrap_or_default()
        };
        assert!(hint("--rig", "plumb run --rig rig.toml").contains("put it first"));
        assert!(hint("a.csv", "plumb run rig.toml a.csv").contains("--path FILE"));
        let spaces = "without spaces";
        assert!(hint("0.2", "plumb demo --target 0.5 0.2 0.3").contains(spaces));
        assert!(hint("0.2,", "plumb run rig.toml --centre 0.5, 0.2, 0.3").contains(spaces));
        // The parser names the beginning of a negative number.
        assert!(hint("-0", "plumb run rig.toml --centre 0.5, -0.2, 0.3").contains(spaces));
        assert!(hint("0.3", "plumb run rig.toml --centre 0.5,-0.2, 0.3").contains(spaces));
        assert!(hint("0.6", "plumb run rig.toml 0.6 0.2 0.3").contains("plumb goto"));
        assert!(hint("circle", "plumb run rig.toml circle").contains("--path circle"));
        assert!(hint("circle", "plumb -v demo circle").contains("--path circle"));
        for (word, line) in [
            ("--ye", "plumb check rig.toml --ye"),
            ("--rig", "plumb demo --rig rig.toml"),
            ("0.4", "plumb demo 0.4"),
            ("circle", "plumb check rig.toml circle"),
            ("a.csv", "plumb replay rec a.csv"),
        ] {
            assert_eq!(hint(word, line), "", "{line}");
        }
    }
}
