//! `plumb completions` and `plumb man`: the command line, described for a shell and for `man`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Command, Parser};
use clap_complete::Shell;
use plumb_config::error_chain::ErrorChain;

use super::print::{self, note};
use super::{Failure, failed};

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

pub(crate) fn completions(args: &CompletionsArgs, mut cli: Command) -> Result<ExitCode, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut cli, "plumb", &mut script);
    print::result(String::from_utf8_lossy(&script).trim_end())?;
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn man(args: &ManArgs, cli: Command) -> Result<ExitCode, Failure> {
    let folder = &args.folder;
    let written = std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(cli, folder).map(drop));
    written.map_err(|error| failed(format!("{}: {}", folder.display(), ErrorChain(&error))))?;
    note!("manual pages: {}", args.folder.display());
    Ok(ExitCode::SUCCESS)
}
