//! The program `plumb`.

// These panic where nobody reads what they print: `commands::print` does not.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod commands;
// The starts of all commands are tried.
#[cfg(all(test, feature = "full"))]
mod starts;

use std::process::ExitCode;

use clap::{ArgAction, CommandFactory, Parser, Subcommand};
use plumb_config::book::first_page;

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

fn main() -> ExitCode {
    if let Err(error) = commands::outlive_file_size_limit() {
        return commands::Failure::from(error).report();
    }
    let cli = match Cli::try_parse_from(commands::command_line()) {
        Ok(cli) => cli,
        Err(error) => return commands::report_usage(&error),
    };
    commands::print::set_quiet(cli.quiet);
    let log = match commands::verbose::start(cli.verbose) {
        Ok(log) => log,
        Err(failure) => return failure.report(),
    };
    let result = match cli.command {
        Command::Demo(args) => commands::demo::main(args),
        Command::Run(args) => commands::run::run(args),
        Command::Goto(args) => commands::run::goto(args),
        Command::Follow(args) => commands::follow::follow(args),
        Command::Hold(args) => commands::hold::main(args),
        Command::Jog(args) => commands::motors::jog(args),
        Command::Home(args) => commands::motors::home(args),
        Command::Stop(args) => commands::motors::stop(args),
        Command::Clear(args) => commands::motors::clear(args),
        Command::Board(args) => commands::board::main(args),
        Command::Init(args) => commands::init::main(args),
        Command::Check(args) => commands::check::main(args),
        Command::Replay(args) => commands::replay::main(args),
        Command::Plot(args) => commands::plot::main(args),
        Command::Cameras(args) => commands::cameras::main(args),
        Command::Calibrate(args) => commands::calibrate::main(args),
        Command::Report(args) => commands::report::main(&args),
        Command::Emulate(args) => commands::emulate::main(args),
        Command::Cosim(args) => commands::cosim::main(args),
        Command::Completions(args) => commands::manual::completions(&args, Cli::command()),
        Command::Man(args) => commands::manual::man(&args, Cli::command()),
    };
    // The messages of the log come before the failure.
    drop(log);
    match result {
        Ok(code) => code,
        Err(failure) => failure.report(),
    }
}
