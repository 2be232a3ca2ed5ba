//! Starts of the commands with numbers far from those of a rig: none panics, and none takes longer
//! than a second of the processor's time.
//!
//! A start is the preparation of a command: it parses, reads its files, plans and opens its port,
//! which does not exist.

mod command_line;
mod files;
mod watch;

use clap::Parser;

use super::Cli;

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

/// Parses a command line and prepares its command. Returns the message of its end: `Err` where the
/// parser refuses the line.
fn begin_line(line: &[String]) -> Result<String, String> {
    let cli = Cli::try_parse_from(std::iter::once(&"plumb".to_owned()).chain(line));
    let prepared = cli.map_err(|error| error.to_string())?.command.prepare();
    Ok(prepared.err().map(|failure| failure.message()).unwrap_or_default())
}
