//! What a mistyped command or option of the command line may mean.

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, CommandFactory};
use plumb_config::misspelt::nearest;

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

/// Returns the word that the mistyped one of `error` probably means; `None` where none is near.
pub(super) fn similar(error: &clap::Error) -> Option<String> {
    let (typed, suggested, what) = match error.kind() {
        ErrorKind::InvalidSubcommand => {
            (ContextKind::InvalidSubcommand, ContextKind::SuggestedSubcommand, "subcommand")
        }
        ErrorKind::UnknownArgument => {
            (ContextKind::InvalidArg, ContextKind::SuggestedArg, "argument")
        }
        _ => (ContextKind::InvalidValue, ContextKind::SuggestedValue, "value"),
    };
    let ContextValue::String(word) = error.get(typed)? else { return None };
    let names = match error.get(suggested)? {
        ContextValue::String(name) => std::slice::from_ref(name),
        ContextValue::Strings(names) => names,
        _ => return None,
    };
    let bare = |text: &str| text.trim_start_matches('-').to_owned();
    let (word, names): (_, Vec<String>) = (bare(word), names.iter().map(|it| bare(it)).collect());
    let begun = names.iter().find(|name| word.len() >= 3 && name.starts_with(&word));
    let name = begun.map(String::as_str);
    let name = name.or_else(|| nearest(&word, names.iter().map(String::as_str)))?;
    let dashes = if what == "argument" { "--" } else { "" };
    Some(format!("a similar {what} exists: '{dashes}{name}'"))
}

/// Returns what there is to choose from in place of the unknown command or option of `error`.
pub(super) fn choice(error: &clap::Error, words: &[String]) -> Option<String> {
    match unknown_command(error) {
        Some("version") => Some("write `plumb --version`".to_owned()),
        Some(_) => {
            let command = command_of(words);
            let names: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
            Some(format!("the commands are {}", names.join(", ")))
        }
        None => unexpected_word(error).and_then(commands_with),
    }
}

/// Returns the commands that have the option `word`; `None` where there is none.
fn commands_with(word: &str) -> Option<String> {
    let cli = crate::Cli::command();
    let name = word.strip_prefix("--")?;
    let has_it = |command: &&Command| {
        has_option(command, name) || command.get_subcommands().any(|it| has_option(it, name))
    };
    let commands = cli.get_subcommands().filter(has_it);
    let names: Vec<&str> = commands.map(Command::get_name).collect();
    (!names.is_empty()).then(|| format!("commands with {word}: {}", names.join(", ")))
}

/// Returns the command of the command line `words`, or the group of commands that it names.
fn command_of(words: &[String]) -> Command {
    let mut command = crate::Cli::command();
    for word in words.iter().skip(1).filter(|word| !word.starts_with('-')) {
        let Some(found) = command.find_subcommand(word) else { break };
        command = found.clone();
    }
    command
}

/// Returns whether a command has the option `--NAME`.
fn has_option(command: &Command, name: &str) -> bool {
    command.get_arguments().any(|option| option.get_long() == Some(name))
}
