//! Starts of the commands with numbers far from those of a rig: none panics, and none takes longer
//! than a second of the processor's time.
//!
//! A start is what a command does before its work: it parses, reads its files, plans and builds.
//! [`begin`] runs the code of the command itself, up to the place where a board or a camera is
//! needed: the port does not exist.

mod command_line;
mod files;
mod watch;

use clap::Parser;

use super::{Cli, Command, commands};
use commands::Failure;

/// Numbers that every option and every key is given.
const NUMBERS: [&str; 16] = [
    "0",
    "-1e-308",
    "1e-300",
    "1e-9",
    "0.001",
    "0.3",
    "1",
    "-1",
    "7",
    "1000",
    "1e6",
    "1e308",
    "-1e308",
    "nan",
    "inf",
    "1000000000000",
];

/// Port that does not exist.
const NO_PORT: &str = "/dev/plumb-no-such-port";

/// Parses a command line and begins its command. Returns the message of its end: `Err` where the
/// parser refuses the line.
fn begin_line(line: &[String]) -> Result<String, String> {
    let cli = Cli::try_parse_from(std::iter::once(&"plumb".to_owned()).chain(line));
    let cli = cli.map_err(|error| error.to_string())?;
    Ok(begin(cli.command).err().map(|failure| failure.message()).unwrap_or_default())
}

/// Begins a command.
fn begin(command: Command) -> Result<(), Failure> {
    use commands::{board, calibrate, check, cosim, demo, emulate, hold, init, motors};
    match command {
        Command::Demo(args) => demo::begin(&args),
        Command::Run(args) => commands::run::run(args).map(drop),
        Command::Goto(args) => commands::run::goto(args).map(drop),
        Command::Follow(args) => commands::follow::follow(args).map(drop),
        Command::Hold(args) => hold::main(args).map(drop),
        Command::Jog(args) => motors::jog(args).map(drop),
        Command::Home(args) => motors::home(args).map(drop),
        Command::Stop(args) => motors::stop(args).map(drop),
        Command::Clear(args) => motors::clear(args).map(drop),
        Command::Board(args) => board::main(args).map(drop),
        Command::Init(args) => init::main(args).map(drop),
        Command::Check(args) => check::main(args).map(drop),
        Command::Plot(args) => commands::plot::main(args).map(drop),
        Command::Calibrate(args) => calibrate::begin(args),
        Command::Report(args) => commands::report::main(&args).map(drop),
        Command::Emulate(args) => emulate::begin(&args),
        Command::Cosim(args) => cosim::begin(&args),
        // They have no numbers.
        Command::Replay(_) | Command::Cameras(_) | Command::Completions(_) | Command::Man(_) => {
            Ok(())
        }
    }
}
