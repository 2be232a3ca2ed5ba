//! Errors of the link between host and board.

use std::error::Error;
use std::path::Path;
use std::time::Duration;

use plumb_config::book::page;
use plumb_protocol::RELEASE;
use plumb_protocol::message::{Fault, Refusal, StartCause};
use thiserror::Error;

use super::pseudo_terminal::is_pseudo_terminal;
use crate::board_fault::after_fault;

/// What to look at where the board behind a pseudo-terminal does not answer.
const EMULATED: &str = "; look whether its program still runs (`plumb emulate`)";

/// Frames that were damaged on the wire in the last two seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Damage {
    /// Frames to the board, by its own count.
    pub to_board: u32,
    /// Frames from the board.
    pub to_host: u32,
}

impl Damage {
    /// Returns the end of a message: the damage as its cause, or `otherwise` where there was none.
    fn or(&self, otherwise: &str) -> String {
        let Self { to_board, to_host } = self;
        if to_board + to_host == 0 {
            return otherwise.to_owned();
        }
        format!(
            ": {to_host} frames from the board and {to_board} frames to it were damaged on the \
             wire; check the baud rate, the cable and the ground"
        )
    }
}

/// Failure of the link to the board.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The port does not exist.
    #[error("{port}: there is no such serial port; {}", absent_hint(.port))]
    Absent {
        /// Its path.
        port: String,
    },
    /// The path is of something that is no serial port.
    #[error(
        "{port}: this is {kind}, not a serial port; name the port of the board \
         (`ls /dev/ttyACM* /dev/ttyUSB*` lists them)"
    )]
    NotAPort {
        /// Its path.
        port: String,
        /// What it is, with its article.
        kind: &'static str,
    },
    /// Another program uses the port.
    #[error(
        "{port}: another program uses this serial port; `sudo fuser -v {port}` names it ({}, \"The \
         port\")",
        page("board")
    )]
    Busy {
        /// Its path.
        port: String,
    },
    /// This user may not open the port.
    #[error(
        "{port}: no permission to open this serial port; on Debian: \
         `sudo adduser $USER dialout`, then log in again"
    )]
    Permission {
        /// Its path.
        port: String,
    },
    /// The port cannot be opened for another reason.
    #[error("{port}: cannot be opened as a serial port")]
    Open {
        /// Its path.
        port: String,
        /// Error of the operating system.
        source: serialport::Error,
    },
    /// The operating system cannot list its ports.
    #[error("the serial ports cannot be listed; name the board's with --port")]
    Ports {
        /// Error of the operating system.
        source: serialport::Error,
    },
    /// The port was open and is gone.
    #[error("{port}: the board was unplugged, or its link broke")]
    Lost {
        /// Its path.
        port: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The board does not answer a request.
    #[error(
        "{port}: no answer to {what} within {waited:?}{}",
        .damage.or(hint(.port, silence_hint(.what)))
    )]
    Silent {
        /// Its path.
        port: String,
        /// The request.
        what: &'static str,
        /// Time that the host waited.
        waited: Duration,
        /// Damage on the wire.
        damage: Damage,
    },
    /// The board does not send telemetry any more.
    #[error(
        "{port}: nothing has come from the board for {:.1} s{}. It stops by itself where no \
         message reaches it",
        .age.as_secs_f64(),
        .damage.or(hint(.port, "; is it powered, and its cable plugged in?"))
    )]
    NoTelemetry {
        /// Its path.
        port: String,
        /// Time since the last telemetry.
        age: Duration,
        /// Damage on the wire.
        damage: Damage,
    },
    /// The board answers, but positions arrive late or not at all.
    #[error(
        "{port}: the board has not acknowledged a position for {:.1} s{}",
        .age.as_secs_f64(),
        .damage.or(": the link is too slow, or loses too much; check the baud rate and the cable")
    )]
    Lagging {
        /// Its path.
        port: String,
        /// Time since the oldest position without an acknowledgement was sent.
        age: Duration,
        /// Damage on the wire.
        damage: Damage,
    },
    /// The board restarted and has lost its configuration.
    #[error(
        "{port}: the board restarted in mid-run ({}); its motor positions begin at 0 where the \
         motors stand now. The motors had no current meanwhile, and the ball may have fallen. \
         Check the board's supply and its cables, hang the ball again, then run `plumb home` with \
         it at a known place",
        .cause.map_or_else(|| "without a reported cause".to_owned(), |cause| cause.to_string())
    )]
    Restarted {
        /// Its path.
        port: String,
        /// Cause of the restart, if the board reported it.
        cause: Option<StartCause>,
    },
    /// The board has lost this session; the cause is unknown, since the board does not answer, or
    /// had no configuration of this program.
    #[error(
        "{port}: the board has lost its session with this program, and the cause is not known: it \
         restarted, or a program of another version has greeted it"
    )]
    SessionLost {
        /// Its path.
        port: String,
    },
    /// A program of another protocol version greeted the board, which ended this session.
    #[error(
        "{port}: a program of another version has greeted the board, and the board stopped: close \
         that program, or use the same release"
    )]
    OtherProgram {
        /// Its path.
        port: String,
    },
    /// Another program configured the board.
    #[error("{port}: the board has another configuration now: does another program use it too?")]
    Reconfigured {
        /// Its path.
        port: String,
    },
    /// The motors did not come to rest after a stop.
    #[error(
        "{port}: the motors do not come to rest: after the stop they have not slowed down for \
         {:.1} s",
        .waited.as_secs_f64()
    )]
    NotAtRest {
        /// Its path.
        port: String,
        /// Time since the motors last slowed down.
        waited: Duration,
    },
    /// The board reports that motors turn for longer than they can.
    #[error(
        "{port}: the board reports that motors turn {:.1} s after the beginning of {what}, which \
         takes {:.1} s at most: press the emergency button if they turn, and report it",
        .waited.as_secs_f64(), .longest.as_secs_f64()
    )]
    StillTurning {
        /// Its path.
        port: String,
        /// What should have ended.
        what: &'static str,
        /// Time since it began.
        waited: Duration,
        /// Its longest time.
        longest: Duration,
    },
    /// The board was sent into its bootloader and still runs its program.
    #[error(
        "{port}: the board accepted the request and still answers after {:.1} s: it has not \
         restarted into its bootloader; an emulated board has none, and starts its program again",
        .waited.as_secs_f64()
    )]
    StillThere {
        /// Its path.
        port: String,
        /// Time that the host waited.
        waited: Duration,
    },
    /// The board has another version of the protocol.
    #[error(
        "{port}: the board runs {runs}, which this program, Plumb {RELEASE}, does not speak with: \
         flash the firmware of this release ({})",
        page("board")
    )]
    Version {
        /// Its path.
        port: String,
        /// The board's program, or its protocol's version if it does not tell its program.
        runs: String,
    },
    /// The board refused a request.
    #[error("the board refused {what}: {refusal}")]
    Refused {
        /// The request.
        what: &'static str,
        /// Reason of the refusal.
        refusal: Refusal,
    },
    /// The board has stopped by itself.
    #[error("the board has stopped by itself: {0}")]
    Fault(Fault),
    /// The board has stopped by itself before this host connected, and its fault is not cleared.
    #[error(
        "{port}: the board stands in a fault ({fault}). {} Nothing has moved",
        after_fault(*.fault)
    )]
    Faulted {
        /// Its path.
        port: String,
        /// The fault.
        fault: Fault,
    },
    /// A board that is not emulated gives its time to the host.
    #[error("{port}: this board is not emulated, and must not lead the time of its host")]
    Leads {
        /// Its path.
        port: String,
    },
    /// Error of a transport that this crate does not know.
    #[error(transparent)]
    Other(Box<dyn Error + Send + Sync>),
    /// A message does not fit a frame.
    #[error(transparent)]
    TooLong(#[from] plumb_protocol::frame::TooLong),
}

/// The first request, as in "no answer to the greeting".
pub(super) const GREETING: &str = "the greeting";

/// Returns what to look at where the board at `port` is silent: `real`, or the program of an
/// emulated one, which has no plug.
fn hint<'a>(port: &str, real: &'a str) -> &'a str {
    if is_pseudo_terminal(Path::new(port)) { EMULATED } else { real }
}

/// Returns what to look at where the board does not answer a request. One that has never answered
/// may be none.
fn silence_hint(what: &str) -> &'static str {
    if what != GREETING {
        return "; is the board powered, and are plug and cable firm?";
    }
    "; look at, in this order: the port (`ls /dev/ttyACM* /dev/ttyUSB*` lists them), power and \
     cable, other programs that use the port (a serial monitor), the board's firmware (`plumb \
     board flash` writes it), and on a UART the baud rate (`--baud`)"
}

/// Returns what to look at where there is no port of this name.
fn absent_hint(port: &str) -> String {
    let absent = "is the board plugged in? (`ls /dev/ttyACM* /dev/ttyUSB*` lists them)";
    other_port(port).unwrap_or_else(|| absent.to_owned())
}

/// Returns what to write in place of a name that no port has: ttyACM0, COM3, or an empty one;
/// `None` for other names.
pub fn other_port(name: &str) -> Option<String> {
    if name.trim().is_empty() {
        return Some("name the port of the board, such as /dev/ttyACM0".to_owned());
    }
    let rest = name.strip_prefix("tty").unwrap_or_default();
    let is_device = rest.starts_with(|c: char| c.is_ascii_uppercase());
    let device = is_device.then(|| format!("write /dev/{name}"));
    device.or_else(|| windows_port(name).map(str::to_owned))
}

/// Returns what to write in place of a serial port of Windows, such as COM3; `None` for other
/// names.
pub fn windows_port(name: &str) -> Option<&'static str> {
    let number = name.to_ascii_uppercase().strip_prefix("COM")?.parse::<u8>();
    number.is_ok().then_some("that is a port of Windows; on Linux a Pico is /dev/ttyACM0")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_silent_board_needs_depends_on_whether_it_has_answered_before() {
        let silent = |what, damage| {
            let (port, waited) = ("/dev/ttyACM0".to_owned(), Duration::from_millis(1500));
            LinkError::Silent { port, what, waited, damage }.to_string()
        };
        let text = silent(GREETING, Damage::default());
        assert!(text.contains("no answer to the greeting within 1.5s; look at, in this"), "{text}");
        for thing in ["the port", "cable", "other programs", "plumb board flash", "--baud"] {
            assert!(text.contains(thing), "{thing}: {text}");
        }
        assert!(silent("the jog", Damage::default()).ends_with("are plug and cable firm?"));
        let damaged = silent(GREETING, Damage { to_board: 0, to_host: 3 });
        assert!(damaged.ends_with("check the baud rate, the cable and the ground"), "{damaged}");
    }
}
