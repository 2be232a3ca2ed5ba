//! Arguments that commands share: the rig file, and the port of the board.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Args;
use plumb_runtime::link::{Serial, boards};
use plumb_runtime::rig::{BoardPort, Rig};

use super::{Failure, bad_input};

/// Environment variable with the rig file of a command line that names none.
pub(crate) const RIG_VARIABLE: &str = "PLUMB_RIG";

/// Baud rate of a board without a rig file, bit/s.
const DEFAULT_BAUD: u32 = 115_200;

/// The rig file of a command that needs one.
#[derive(Args)]
pub(crate) struct RigArg {
    /// Rig file (TOML, SI units)
    #[arg(value_name = "RIG", env = RIG_VARIABLE, hide_env_values = true)]
    pub(crate) rig: PathBuf,
}

/// The serial port of the board.
#[derive(Args)]
pub(crate) struct PortArgs {
    /// Serial port of the board [default: the rig file's]
    #[arg(long, env = "PLUMB_PORT", hide_env_values = true)]
    port: Option<String>,
    /// Baud rate, where the port is a UART [default: the rig file's]
    #[arg(long)]
    baud: Option<u32>,
}

impl PortArgs {
    /// Opens the port of the options, or else that of the rig file.
    pub(crate) fn open(&self, board: &BoardPort) -> Result<Serial, Failure> {
        let port = self.named().unwrap_or(&board.port);
        Ok(Serial::open(port, self.baud.unwrap_or(board.baud))?)
    }

    /// Returns the port of the options. An empty PLUMB_PORT names none.
    fn named(&self) -> Option<&str> {
        self.port.as_deref().filter(|port| !port.is_empty())
    }
}

/// The board of a command that needs no configuration.
#[derive(Args)]
pub(crate) struct BoardArgs {
    /// Rig file, for the port of its board [default: the one Plumb board on USB]
    #[arg(value_name = "RIG", env = RIG_VARIABLE, hide_env_values = true)]
    rig: Option<PathBuf>,
    #[command(flatten)]
    port: PortArgs,
    /// End with a line of JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

impl BoardArgs {
    /// Opens the port of the options, of the rig file, or of the one board on USB, in this order.
    pub(crate) fn open(&self) -> Result<Serial, Failure> {
        let board = match (self.port.named(), &self.rig) {
            (Some(port), _) => BoardPort { port: port.to_owned(), baud: DEFAULT_BAUD },
            (None, Some(rig)) => Rig::read(rig)?.board,
            (None, None) => BoardPort { port: only_board()?, baud: DEFAULT_BAUD },
        };
        self.port.open(&board)
    }
}

/// Returns the port of the one board that is plugged in.
fn only_board() -> Result<String, Failure> {
    let found = boards()?;
    match &found[..] {
        [port] => Ok(port.clone()),
        [] => Err(bad_input("no Plumb board is on USB; plug it in, or name its port with --port")),
        several => Err(bad_input(format!(
            "several Plumb boards are on USB; choose one with --port: {}",
            several.join(", ")
        ))),
    }
}

/// Splits the words of `plumb COMMAND [RIG] VALUE...` into the rig file and `count` values. With
/// `count` words the rig file is that of [`RIG_VARIABLE`].
///
/// # Errors
/// Where the number of words is wrong, or nothing names the rig file.
pub(crate) fn split_rig(
    words: impl IntoIterator<Item = Option<String>>,
    count: usize,
    usage: &str,
) -> Result<(PathBuf, Vec<String>), Failure> {
    let mut words: Vec<String> = words.into_iter().flatten().collect();
    if words.len() == count + 1 {
        let rig = words.remove(0).into();
        return Ok((rig, words));
    }
    if words.len() != count {
        return Err(bad_input(format!("usage: {usage}")));
    }
    match std::env::var_os(RIG_VARIABLE).filter(|path: &OsString| !path.is_empty()) {
        Some(rig) => Ok((rig.into(), words)),
        None => Err(bad_input(format!(
            "no rig file is named: put it first, or set {RIG_VARIABLE}; usage: {usage}"
        ))),
    }
}
