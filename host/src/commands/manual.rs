//! `plumb completions` and `plumb man`: the command line, described for a shell and for `man`.

use std::path::PathBuf;

use clap::{Command, Parser};
use clap_complete::Shell;

use crate::cli::exit::{Exit, Failure, Unwritten, Work, failed};
use crate::cli::print;

/// Print the completions of commands and options for a shell
#[derive(Parser)]
#[command(after_help = examples![
    "plumb completions bash > ~/.local/share/bash-completion/completions/plumb",
    "plumb completions zsh > ~/.zfunc/_plumb",
])]
pub(crate) struct CompletionsArgs {
    /// Shell
    shell: Shell,
}

/// Write the manual pages into a folder
#[derive(Parser)]
#[command(after_help = examples!["plumb man ~/.local/share/man/man1", "man plumb-run"])]
pub(crate) struct ManArgs {
    /// Folder, which is created where it is missing
    folder: PathBuf,
}

/// Prepares `plumb completions` for the command line `cli`.
pub(crate) fn completions(args: CompletionsArgs, mut cli: Command) -> Work {
    Box::new(move || {
        let mut script = Vec::new();
        clap_complete::generate(args.shell, &mut cli, "plumb", &mut script);
        print::result(String::from_utf8_lossy(&script).trim_end())?;
        Ok(Exit::Done)
    })
}

/// Prepares `plumb man` for the command line `cli`.
pub(crate) fn man(args: ManArgs, cli: Command) -> Result<Work, Failure> {
    let folder = args.folder;
    if folder.exists() && !folder.is_dir() {
        let name = folder.display();
        return Err(failed(format!("{name}: is a file, but must be a folder: name another one")));
    }
    let mut cli = cli.disable_help_subcommand(true);
    cli.build();
    let pages = with_synopses(cli).mut_subcommands(with_version);
    Ok(Box::new(move || {
        let written = std::fs::create_dir_all(&folder)
            .and_then(|()| clap_mangen::generate_to(pages, &folder).map(drop));
        written.map_err(Unwritten::at(&folder))?;
        note!("The manual pages are in {}", folder.display());
        Ok(Exit::Done)
    }))
}

/// Returns `command` with its synopsis as its usage, likewise its subcommands.
fn with_synopses(mut command: Command) -> Command {
    let own = synopsis(&mut command);
    command.override_usage(own).mut_subcommands(with_synopses)
}

/// Returns `command` with the version of the program, for the head of its page, likewise its
/// subcommands.
fn with_version(command: Command) -> Command {
    let command = command.version(env!("CARGO_PKG_VERSION")).disable_version_flag(true);
    command.mut_subcommands(with_version)
}

/// Returns the usage of a command with all its options and the names of their values, where that of
/// `--help` has the word OPTIONS.
fn synopsis(command: &mut Command) -> String {
    let usage = command.render_usage().to_string();
    let groups = command.get_groups().filter(|group| group.is_required_set());
    let alternatives: Vec<_> = groups.flat_map(|group| group.get_args()).collect();
    let options = command.get_arguments().filter(|option| {
        !option.is_positional()
            && !option.is_hide_set()
            && !option.is_required_set()
            && !alternatives.contains(&option.get_id())
    });
    let options: Vec<String> = options.map(|option| format!("[{option}]")).collect();
    usage.trim_start_matches("Usage: ").replace("[OPTIONS]", &options.join(" "))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    /// Returns the synopsis of a command of the program.
    fn synopsis_of(name: &str) -> String {
        let mut cli = crate::Cli::command();
        cli.build();
        synopsis(cli.find_subcommand_mut(name).expect("the command exists"))
    }

    #[test]
    fn a_synopsis_has_every_option_with_its_value() {
        let run = synopsis_of("run");
        assert!(run.starts_with("plumb run [--rig <FILE>] "), "{run}");
        assert!(!run.contains("OPTIONS"), "{run}");
        for option in ["[--timeout <TIMEOUT>]", "[--json]", "[--out <FOLDER>]", "[--quiet]"] {
            assert!(run.contains(option), "{run}");
        }
        assert!(synopsis_of("goto").ends_with("] <X> <Y> [Z]"));
    }

    #[test]
    fn the_page_of_each_command_names_the_version() {
        let cli = crate::Cli::command().mut_subcommands(with_version);
        let board = cli.find_subcommand("board").expect("the command exists");
        let flash = board.find_subcommand("flash").expect("the command exists");
        assert_eq!(flash.get_version(), cli.get_version());
    }

    #[test]
    fn alternatives_of_which_one_is_needed_stand_once() {
        let calibrate = synopsis_of("calibrate");
        assert_eq!(calibrate.matches("--ball").count(), 1, "{calibrate}");
        assert!(calibrate.contains("[--origin <X,Y,Z>]"), "{calibrate}");
    }
}
