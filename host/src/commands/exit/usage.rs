//! The end of a command by a mistake in its command line.

use std::process::ExitCode;

use clap::CommandFactory;
use clap::error::{ContextKind, ContextValue, ErrorKind};

use super::suggestions::{
    choice, command_of, has_option, has_rig, similar, unexpected_word, unknown_command,
};
use super::{BAD_INPUT, Failure, bad_input};
use crate::commands::command_line;
use crate::commands::number_list::place_in;
use crate::commands::print::tell;
use crate::commands::rig_path::{RIG_VARIABLE, absent_rig, no_rig};
use crate::commands::words::{
    DRIVES_THROUGH_LIST, aim_hint, goto_command, is_file_name, is_list, port_in, shape_option,
};

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
    let words: Vec<String> =
        command_line().iter().map(|word| word.to_string_lossy().into()).collect();
    let unexpected = unexpected_word(error);
    let hint = unexpected.and_then(|word| hint(word, &words));
    let is_untold = unexpected.is_some() && hint.is_none();
    if let Some(error) = (is_untold || is_about_rig(error)).then(|| unit_error(&words)).flatten() {
        return report_usage(&error);
    }
    let UsageError { usage, message, tips } = UsageError::of(&error.render().to_string());
    if !usage.is_empty() {
        tell!("{usage}");
    }
    let hint = hint.or_else(|| unknown_command(error).and_then(command_hint));
    // A similar word is a guess.
    let hint = hint.or_else(|| similar(error)).or_else(|| choice(error, &words));
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

/// Returns what to write in place of `word`, where a command below another one has this name, or it
/// is a file, a shape or a place.
fn command_hint(word: &str) -> Option<String> {
    let cli = crate::Cli::command();
    let mut groups = cli.get_subcommands();
    if let Some(group) = groups.find(|group| group.find_subcommand(word).is_some()) {
        Some(format!("write `plumb {} {word}`", group.get_name()))
    } else if is_file_name(word) {
        Some(format!("a command comes first: `plumb run {word}`"))
    } else {
        aim_hint(word)
    }
}

/// Returns what to write in place of `word`, which the command line `words` must not have.
fn hint(word: &str, words: &[String]) -> Option<String> {
    let command = words.iter().skip(1).find(|it| !it.starts_with('-'));
    let command = command.map(String::as_str).unwrap_or_default();
    let word = whole_word(word, words);
    if word == "--rig" && has_rig(&command_of(words)) {
        Some(format!("the rig file has no option: put it first, or set {RIG_VARIABLE}"))
    } else if is_number(word) && is_behind_number(word, words) {
        Some("several numbers of an option stand without spaces: 0.4,0.2,0.15".to_owned())
    } else {
        option_hint(word, command, words).or_else(|| port_hint(word, words))
    }
}

/// Returns how the port among `words` is given to a command with `--port`, where `word` is one too
/// many; `None` where there is no port.
fn port_hint(word: &str, words: &[String]) -> Option<String> {
    let is_free = |pair: &&[String]| pair[1] == word || !pair[0].starts_with("--");
    let ports = words.windows(2).filter(is_free).filter_map(|pair| port_in(&pair[1]));
    let has_port = !word.starts_with('-') && has_option(&command_of(words), "port");
    let port = has_port.then_some(ports).into_iter().flatten().next()?;
    Some(format!("for the board's port: --port {}", port.display()))
}

/// Returns the word of which the parser names the beginning as an option: a negative number.
fn whole_word<'a>(word: &'a str, words: &'a [String]) -> &'a str {
    let is_negative = word.starts_with('-') && is_number(word);
    let whole = words.iter().find(|it| is_negative && it.starts_with(word));
    whole.map_or(word, String::as_str)
}

/// Returns whether `word` stands behind another number, and the first of them behind an option.
fn is_behind_number(word: &str, words: &[String]) -> bool {
    let is_behind = |place: usize| {
        let mut before = words[..place].iter().rev().skip_while(|it| is_number(it));
        let has_number = words[..place].last().is_some_and(|it| is_number(it));
        has_number && before.next().is_some_and(|it| it.starts_with("--"))
    };
    (0..words.len()).any(|place| words[place] == word && is_behind(place))
}

/// Returns whether `word` is a number, or several with commas between them.
fn is_number(word: &str) -> bool {
    word.trim_matches(',').split(',').all(|number| number.parse::<f64>().is_ok())
}

/// Returns how `word`, a place, a shape, a list of places or a rig file, is given to `command`;
/// `None` for another word, and for a command that has no such thing.
fn option_hint(word: &str, command: &str, words: &[String]) -> Option<String> {
    let shape = shape_option(word);
    match command {
        "emulate" if word == "--port" => {
            Some("an emulated board has a port of its own: --link PATH names it".to_owned())
        }
        "replay" if word == "--rig" => {
            Some("a recording takes a camera file, and no rig file: --camera FILE".to_owned())
        }
        "demo" if word == "--port" => {
            Some("the demo has its own board: `plumb run RIG --port PORT` takes another".to_owned())
        }
        "demo" if word == "--rig" || is_file_name(word) => {
            Some("the demo has its own rig: `plumb run RIG` takes a rig file".to_owned())
        }
        "run" if place_in(word).is_some() => aim_hint(word),
        "goto" if ["m", "cm", "mm"].contains(&word) => {
            Some("write numbers alone, the coordinates in m".to_owned())
        }
        "goto" => {
            let rig = words.iter().find(|word| is_file_name(word)).map(String::as_str);
            let command = |place: String| goto_command(rig.or(absent_rig()), &place);
            place_in(word).map(|place| format!("write {}", command(place)))
        }
        "run" | "demo" if shape.is_some() => shape.map(|option| format!("for a shape: {option}")),
        "run" if is_list(word) => Some(format!("for a list of places: {DRIVES_THROUGH_LIST}")),
        "demo" if is_list(word) => Some(format!("for a list of places: --path {word}")),
        "run" if is_number(word) => {
            Some("to go to one place: `plumb goto RIG 0.4 0.2 0.15`".to_owned())
        }
        _ => None,
    }
}

/// Returns the error about the number of an option whose unit is a word of its own, as that about a
/// unit right behind it: "--timeout 30 s". `None` for a command line without such a unit.
fn unit_error(words: &[String]) -> Option<clap::Error> {
    let is_unit = |word: &str| {
        let is_of_letters = word.chars().all(|c| c.is_alphabetic() || "/%°".contains(c));
        is_of_letters && shape_option(word).is_none()
    };
    let is_value = |word: &str| word.rsplit('=').next().is_some_and(is_number);
    let place = words.windows(2).position(|pair| is_value(&pair[0]) && is_unit(&pair[1]))?;
    let number_with_unit = format!("{} {}", words[place], words[place + 1]);
    let [before, after] = [&words[..place], &words[place + 2..]];
    let joined = before.iter().chain([&number_with_unit]).chain(after);
    let error = crate::Cli::command().try_get_matches_from(joined).err()?;
    (error.kind() == ErrorKind::ValueValidation && !is_about_rig(&error)).then_some(error)
}

/// Returns whether the mistake is a word that is no rig file.
fn is_about_rig(error: &clap::Error) -> bool {
    let name = error.get(ContextKind::InvalidArg).map(ContextValue::to_string);
    error.kind() == ErrorKind::ValueValidation
        && name.is_some_and(|name| name.trim_matches(|c| "[]<>".contains(c)) == "RIG")
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
    fn an_error_of_the_command_line_is_one_line_without_useless_tips() {
        let text = "error: unexpected argument '--pag' found\n\n  tip: a similar argument exists: \
                    '--page'\n  tip: to pass '--pag' as a value, use '-- --pag'\n\nUsage: plumb \
                    run [OPTIONS] [RIG]\n\nFor more information, try '--help'.\n";
        let UsageError { usage, message, tips } = UsageError::of(text);
        assert_eq!(usage, "Usage: plumb run [OPTIONS] [RIG]");
        assert_eq!(message, "unexpected argument '--pag' found");
        assert_eq!(tips, "");
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
        assert!(hint("--rig", "plumb jog --rig rig.toml").contains("put it first"));
        assert!(hint("--rig", "plumb board save --rig rig.toml").contains("put it first"));
        assert!(hint("--rig", "plumb replay --rig r.toml rec").ends_with("--camera FILE"));
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
        assert!(hint("--rig", "plumb demo --rig rig.toml").contains("the demo has its own rig"));
        assert!(hint("rig.toml", "plumb demo rig.toml").contains("the demo has its own rig"));
        let port = hint("/dev/ttyACM0", "plumb run rig.toml /dev/ttyACM0");
        assert!(port.contains("--port /dev/ttyACM0"), "{port}");
        for (word, line) in [
            ("/dev/ttyACM0", "plumb replay rec /dev/ttyACM0"),
            ("--rig", "plumb bench vision --rig rig.toml"),
            ("--rig", "plumb cameras --rig rig.toml"),
            ("--ye", "plumb check rig.toml --ye"),
            ("0.4", "plumb demo 0.4"),
            ("circle", "plumb check rig.toml circle"),
            ("a.csv", "plumb replay rec a.csv"),
        ] {
            assert_eq!(hint(word, line), "", "{line}");
        }
    }
}
