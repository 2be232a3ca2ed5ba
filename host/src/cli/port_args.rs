//! Arguments that commands share: the port of the board.

use std::fmt;
use std::path::Path;

use clap::Args;
use plumb_cameras::settings::SourceName;
use plumb_config::error_chain::ErrorChain;
use plumb_runtime::link::{LinkError, Serial, boards, is_pseudo_terminal, other_port};
use plumb_runtime::rig::quantity::BAUD;
use plumb_runtime::rig::{BoardName, BoardPort, Rig};

use crate::cli::exit::{Failure, bad_input};
use crate::cli::numbers;
use crate::cli::port::Port;
use crate::cli::rig_path::RigArg;

/// Environment variable with the port of a command line that names none.
const PORT_VARIABLE: &str = "PLUMB_PORT";

/// Baud rate of a board without a rig file, bit/s.
const DEFAULT_BAUD: u32 = 115_200;

/// How a person goes on without a board, for messages.
const EMULATION: &str =
    "`plumb emulate --link board &` starts an emulated board, and `--port board` names it";

/// How a person with the rig file of a real rig goes on without its board, for messages.
const TRIAL: &str = "Without a board: `plumb init trial --simulated` writes a simulated rig";

/// The serial port of the board.
#[derive(Args)]
#[command(next_help_heading = "Board")]
pub(crate) struct PortArgs {
    /// Serial port of the board [default: the rig file's; without a rig file the one Plumb board on
    /// USB]
    #[arg(long, env = PORT_VARIABLE, hide_env_values = true, value_parser = port)]
    port: Option<String>,
    /// Baud rate, where the port is a UART, 300 to 20000000 bit/s [default: the rig file's]
    #[arg(long, allow_negative_numbers = true, value_parser = numbers::whole_within::<u32>(BAUD))]
    baud: Option<u32>,
}

/// The options again, with a space before each, for a command that a person types.
impl fmt::Display for PortArgs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(port) = self.named() {
            write!(f, " --port {port}")?;
        }
        self.baud.map_or(Ok(()), |baud| write!(f, " --baud {baud}"))
    }
}

impl PortArgs {
    /// Opens the port of the options, or else that of the rig file. An emulated board waits for
    /// this program, unless the rig's camera is real.
    ///
    /// # Errors
    /// As [`open_in_real_time`](Self::open_in_real_time).
    pub(crate) fn open(&self, rig: &Rig) -> Result<Port, Failure> {
        let serial = self.open_in_real_time(rig)?;
        let source = rig.camera.source(rig.simulation.is_some());
        let leads = source.is_ok_and(|source| source == SourceName::Simulated);
        Ok(if leads { Port::led(serial) } else { Port::Serial(serial) })
    }

    /// Opens the same port for a run that others share in real time.
    ///
    /// # Errors
    /// Where the port cannot be opened. The board of a simulated rig is emulated, and a port that
    /// does not exist is then that of an emulation.
    pub(crate) fn open_in_real_time(&self, rig: &Rig) -> Result<Serial, Failure> {
        let BoardPort { port, baud } = self.applied_to(&rig.board.address());
        Serial::open(&port, baud).map_err(|error| {
            let is_absent =
                matches!(error, LinkError::Absent { .. }) && other_port(&port).is_none();
            let failure = not_open(error, Some(rig));
            match is_absent && rig.simulation.is_none() {
                true => failure.with_advice(TRIAL),
                false => failure,
            }
        })
    }

    /// Says which rig file and which port the command takes.
    pub(crate) fn note(&self, file: &Path, rig: &Rig) {
        let BoardPort { port, .. } = self.applied_to(&rig.board.address());
        note!("rig file {}, board at {port}", file.display());
    }

    /// Returns the port where a program is at its other end, such as an emulated board.
    pub(crate) fn pseudo_terminal(&self, rig: &Rig) -> Option<String> {
        let BoardPort { port, .. } = self.applied_to(&rig.board.address());
        is_pseudo_terminal(Path::new(&port)).then_some(port)
    }

    /// Returns the port of the options, with that of the rig file for what they leave out.
    fn applied_to(&self, board: &BoardPort) -> BoardPort {
        let port = self.named().unwrap_or(&board.port).to_owned();
        BoardPort { port, baud: self.baud.unwrap_or(board.baud) }
    }

    /// Returns the port of the options or of the rig file; `None` where nothing names one. Likewise
    /// its baud rate. The rig file is read where one of both is missing.
    pub(crate) fn board(&self, rig: Option<&Path>) -> Result<Option<BoardPort>, Failure> {
        let named = self.named().map(|port| self.board_at(port.to_owned()));
        let is_whole = named.is_some() && self.baud.is_some();
        let Some(rig) = rig.filter(|_| !is_whole) else { return Ok(named) };
        match (Rig::read(rig), named) {
            (Ok(rig), _) => Ok(Some(self.applied_to(&rig.board.address()))),
            // A stop must not wait for a rig file that only tells the baud rate.
            (Err(error), Some(board)) => {
                note!("{}; without it the baud rate is {}", ErrorChain(&error), board.baud);
                Ok(Some(board))
            }
            (Err(error), None) => Err(bad_input(format!(
                "{}. Without a rig file: name the port of the board with --port",
                ErrorChain(&error)
            ))),
        }
    }

    /// Returns the port of the options, of the rig file, or of the one board on USB, in this order;
    /// likewise its baud rate. A stop does not wait for a rig file with a mistake.
    pub(crate) fn board_or_only(&self, rig: Option<&Path>) -> Result<BoardPort, Failure> {
        match self.board(rig) {
            Ok(Some(board)) => Ok(board),
            Ok(None) => Ok(self.board_at(only_board()?)),
            Err(failure) => {
                let Ok(only) = only_board() else { return Err(failure) };
                note!("{}; this goes to the board at {only}", failure.message());
                Ok(self.board_at(only))
            }
        }
    }

    /// Returns the board at `port`, at the baud rate of the options.
    pub(crate) fn board_at(&self, port: String) -> BoardPort {
        BoardPort { port, baud: self.baud.unwrap_or(DEFAULT_BAUD) }
    }

    /// Returns the port of the options. An empty PLUMB_PORT names none.
    fn named(&self) -> Option<&str> {
        self.port.as_deref().filter(|port| !port.is_empty())
    }
}

/// Returns the failure to open the port of the board of `rig`. That of a simulated rig is emulated.
/// A port of the options is never empty.
fn not_open(error: LinkError, rig: Option<&Rig>) -> Failure {
    match error {
        LinkError::Absent { port } if port.trim().is_empty() => {
            let advice = other_port(&port).unwrap_or_default();
            bad_input(format!("`board.port` of the rig file is empty: {advice}"))
        }
        LinkError::Absent { port } if rig.is_some_and(|rig| rig.simulation.is_some()) => bad_input(
            format!("{port}: there is no such serial port. This rig is simulated: {EMULATION}"),
        ),
        error => error.into(),
    }
}

/// Rig file and port of a command that only asks its board.
#[derive(Args)]
pub(crate) struct BoardArgs {
    #[command(flatten)]
    pub(crate) rig: RigArg,
    #[command(flatten)]
    pub(crate) port: PortArgs,
    /// End with a line of JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

impl BoardArgs {
    /// Returns the kind of the board in the rig file; `None` without a file.
    pub(crate) fn kind(&self) -> Result<Option<BoardName>, Failure> {
        let rig = self.rig.found().as_deref().map(Rig::read).transpose()?;
        Ok(rig.map(|rig| rig.board.kind))
    }

    /// Opens the port of the options, of the rig file, or of the one board on USB, in this order.
    pub(crate) fn open(&self) -> Result<Port, Failure> {
        let BoardPort { port, baud } = self.board()?;
        Serial::open(&port, baud).map(Port::led).map_err(|error| self.not_open(error))
    }

    /// Returns the failure to open the port of this board.
    pub(crate) fn not_open(&self, error: LinkError) -> Failure {
        not_open(error, self.rig.found().and_then(|path| Rig::read(&path).ok()).as_ref())
    }

    /// Returns the port of the options, of the rig file, or of the one board on USB, in this order;
    /// likewise its baud rate.
    pub(crate) fn board(&self) -> Result<BoardPort, Failure> {
        self.port.board_or_only(self.rig.found().as_deref())
    }
}

/// Returns the port of the one board that is plugged in.
fn only_board() -> Result<String, Failure> {
    let found = boards()?;
    match &found[..] {
        [port] => Ok(port.clone()),
        [] => Err(bad_input(format!(
            "no Plumb board is on USB; plug it in, or name its port with --port or \
             {PORT_VARIABLE}. Without a board: {EMULATION}"
        ))),
        several => Err(bad_input(format!(
            "several Plumb boards are on USB; choose one with --port: {}",
            several.join(", ")
        ))),
    }
}

/// Returns the name of a port from the command line.
///
/// # Errors
/// Where it is empty, and not that of [`PORT_VARIABLE`].
fn port(text: &str) -> Result<String, String> {
    let is_variable = || std::env::var(PORT_VARIABLE).is_ok_and(|port| port == text);
    if text.trim().is_empty() && !is_variable() {
        return Err("name a port, such as /dev/ttyACM0, or leave the option out".to_owned());
    }
    Ok(text.to_owned())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

    use super::*;

    /// Returns port and baud rate of a command with these options and a rig file of `/dev/rig` at
    /// 57600 bit/s.
    fn board(port: Option<&str>, baud: Option<u32>) -> (String, u32) {
        let folder = tempfile::tempdir().unwrap();
        let (rig, file) = (folder.path().join("rig.toml"), "host/rigs/paper.toml");
        let paper = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join(file);
        let lines = std::fs::read_to_string(paper).unwrap();
        let lines = lines.lines().map(|line| match line.split_once(" = ") {
            Some(("port", _)) => "port = \"/dev/rig\"".to_owned(),
            Some(("baud", _)) => "baud = 57600".to_owned(),
            _ => line.to_owned(),
        });
        std::fs::write(&rig, lines.collect::<Vec<_>>().join("\n")).unwrap();
        let port = PortArgs { port: port.map(str::to_owned), baud };
        let board = BoardArgs { rig: RigArg::named(rig), port, json: false }.board();
        let BoardPort { port, baud } = board.unwrap_or_else(|error| panic!("{}", error.message()));
        (port, baud)
    }

    #[test]
    fn the_options_are_repeated_as_they_were_given() {
        let text =
            |port: Option<&str>, baud| PortArgs { port: port.map(str::to_owned), baud }.to_string();
        assert_eq!(text(None, None), "");
        assert_eq!(text(Some("board"), None), " --port board");
        assert_eq!(text(Some("/dev/ttyUSB0"), Some(9600)), " --port /dev/ttyUSB0 --baud 9600");
    }

    #[test]
    fn an_option_replaces_its_key_of_the_rig_file_and_no_other() {
        let [rig, other] = ["/dev/rig", "/dev/other"].map(str::to_owned);
        assert_eq!(board(None, None), (rig.clone(), 57_600));
        assert_eq!(board(Some("/dev/other"), None), (other.clone(), 57_600));
        assert_eq!(board(None, Some(9600)), (rig.clone(), 9600));
        assert_eq!(board(Some("/dev/other"), Some(9600)), (other, 9600));
        assert_eq!(board(Some(""), None), (rig, 57_600));
    }
}
