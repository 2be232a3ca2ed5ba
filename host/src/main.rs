//! The program `plumb`.

// These panic where nobody reads what they print: `cli::print` does not.
#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use]
mod cli;
mod commands;
mod session;
// The starts of all commands are tried.
#[cfg(all(test, feature = "full"))]
mod tests;

use std::process::ExitCode;

use clap::{ArgAction, CommandFactory, Parser, Subcommand};
use plumb_config::book::first_page;

use cli::exit::{Exit, Failure, Work, report_usage};

/// Drives a ball on three cables to a target in space, without a model of the robot.
///
/// Exit codes: 0 done; 1 the command failed or did not reach its aim (a target, a board that is
/// silent, a full disk); 2 the input is wrong (an option, a file, a port that cannot be
/// opened, a configuration that the board refuses); 101 the program has a defect; 129, 130, 143 a
/// signal, such as Ctrl-C, ended it at once: the second one, or the first one before the program
/// had opened the board's port. Messages for people go to standard error.
#[derive(Parser)]
#[command(version, max_term_width = 100, after_help = format!("The book: {}", first_page()))]
struct Cli {
    /// Report on standard error what the program does: -v the steps of a run and of the link to the
    /// board, -vv repeated requests and lost frames too, -vvv also every frame
    #[arg(short, long, action = ArgAction::Count, global = true)]
    verbose: u8,
    /// On standard error print only problems, questions and findings: no progress, no notes, no
    /// result of a command that has done its work
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(commands::demo::Args),
    Run(commands::run::RunArgs),
    Goto(commands::run::GotoArgs),
    Follow(commands::follow::FollowArgs),
    Hold(commands::hold::Args),
    Jog(commands::motors::JogArgs),
    Home(commands::motors::HomeArgs),
    Stop(commands::motors::StopArgs),
    Clear(commands::motors::ClearArgs),
    Board(commands::board::Args),
    Init(commands::init::Args),
    Check(commands::check::Args),
    Replay(commands::replay::Args),
    Plot(commands::plot::Args),
    Cameras(commands::cameras::Args),
    Calibrate(commands::calibrate::Args),
    Report(commands::report::Args),
    Emulate(commands::emulate::Args),
    Cosim(commands::cosim::Args),
    Completions(commands::manual::CompletionsArgs),
    Man(commands::manual::ManArgs),
}

impl Command {
    /// Reads and checks what the command needs. Returns its work.
    fn prepare(self) -> Result<Work, Failure> {
        match self {
            Self::Demo(args) => commands::demo::prepare(args),
            Self::Run(args) => commands::run::run(args),
            Self::Goto(args) => commands::run::goto(args),
            Self::Follow(args) => commands::follow::follow(args),
            Self::Hold(args) => commands::hold::prepare(args),
            Self::Jog(args) => commands::motors::jog(args),
            Self::Home(args) => commands::motors::home(args),
            Self::Stop(args) => commands::motors::stop(args),
            Self::Clear(args) => commands::motors::clear(args),
            Self::Board(args) => commands::board::prepare(args),
            Self::Init(args) => commands::init::prepare(args),
            Self::Check(args) => commands::check::prepare(args),
            Self::Replay(args) => commands::replay::prepare(args),
            Self::Plot(args) => commands::plot::prepare(args),
            Self::Cameras(args) => Ok(commands::cameras::prepare(args)),
            Self::Calibrate(args) => commands::calibrate::prepare(args),
            Self::Report(args) => commands::report::prepare(args),
            Self::Emulate(args) => commands::emulate::prepare(args),
            Self::Cosim(args) => commands::cosim::prepare(args),
            Self::Completions(args) => Ok(commands::manual::completions(args, Cli::command())),
            Self::Man(args) => commands::manual::man(args, Cli::command()),
        }
    }
}

fn main() -> ExitCode {
    ExitCode::from(run() as u8)
}

/// Reads the command line, and does the work of its command.
fn run() -> Exit {
    if let Err(error) = cli::interrupt::outlive_file_size_limit() {
        return Failure::from(error).report(Exit::Failed);
    }
    let cli = match Cli::try_parse_from(cli::home_folder::command_line()) {
        Ok(cli) => cli,
        Err(error) => return report_usage(&error),
    };
    cli::print::set_quiet(cli.quiet);
    let log = match cli::verbose::start(cli.verbose) {
        Ok(log) => log,
        Err(failure) => return failure.report(Exit::Failed),
    };
    let ended = match cli.command.prepare() {
        Ok(work) => work().map_err(|failure| (failure, Exit::Failed)),
        Err(failure) => Err((failure, Exit::BadInput)),
    };
    // The messages of the log come before the failure.
    drop(log);
    ended.unwrap_or_else(|(failure, code)| failure.report(code))
}
