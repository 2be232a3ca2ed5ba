//! Transport of bytes between host and board, over a serial port here.

use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use std::time::{Duration, Instant};

use serialport::{ClearBuffer, SerialPort, SerialPortInfo, SerialPortType, TTYPort};

use super::LinkError;
use super::pseudo_terminal::is_pseudo_terminal;

/// Byte stream to the board and back.
pub trait Transport {
    /// Returns the name of the transport, for errors.
    fn name(&self) -> String;

    /// Returns the time on the link's clock, which never runs backwards: real time, or the virtual
    /// time of an emulated board. All timeouts of a link are measured on it.
    fn now(&self) -> Duration;

    /// Returns whether the board's time is that of the link: the board waits for its host. Only an
    /// emulated board can, and [`Link::connect`](super::Link::connect) refuses others.
    fn leads(&self) -> bool {
        false
    }

    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// Where the link is lost.
    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError>;

    /// Appends what has arrived to `bytes`; where nothing has, waits for `wait` at most.
    ///
    /// # Errors
    /// Where the link is lost.
    fn receive(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError>;
}

/// Serial port: USB-CDC, a UART or a pseudo-terminal.
pub struct Serial {
    name: String,
    port: TTYPort,
    opened: Instant,
}

/// Timeout of a write, and of a whole message: after this time nobody reads at the other end, or
/// far too slowly.
const WRITE_TIMEOUT: Duration = Duration::from_millis(200);

/// USB product name of the firmware (firmware/src/link/usb.rs).
const PRODUCT: &str = "Plumb board";

impl Serial {
    /// Opens `name` for this process only. The rate `baud` has no effect on USB-CDC and
    /// pseudo-terminals.
    ///
    /// # Errors
    /// Where it is absent, busy, not allowed or not a serial port.
    pub fn open(name: &str, baud: u32) -> Result<Self, LinkError> {
        let port = serialport::new(name, baud)
            .timeout(WRITE_TIMEOUT)
            .open_native()
            .map_err(|error| open_error(name, error))?;
        // Discards what an earlier host left unread. DTR is not changed: pseudo-terminals have
        // none.
        let _ = port.clear(ClearBuffer::All);
        Ok(Self { name: name.to_owned(), port, opened: Instant::now() })
    }

    /// Returns whether a program is at the other end, such as an emulated board.
    pub fn is_pseudo_terminal(&self) -> bool {
        is_pseudo_terminal(Path::new(&self.name))
    }

    fn lost(&self, source: std::io::Error) -> LinkError {
        LinkError::Lost { port: self.name.clone(), source }
    }
}

/// List of Linux's terminals. Where it is missing, as in a container without `/sys`, `serialport`
/// panics.
const TERMINALS: &str = "/sys/class/tty";

/// Returns the USB ports of the boards that are plugged in, by their product name; none where Linux
/// has no list of its ports.
///
/// # Errors
/// Where the operating system does not list its ports.
pub fn boards() -> Result<Vec<String>, LinkError> {
    if cfg!(target_os = "linux") && !Path::new(TERMINALS).exists() {
        return Ok(Vec::new());
    }
    let ports = serialport::available_ports().map_err(|source| LinkError::Ports { source })?;
    let is_board = |port: &SerialPortInfo| match &port.port_type {
        // Some systems report the name with underscores.
        SerialPortType::UsbPort(usb) => {
            usb.product.as_ref().is_some_and(|product| product.replace('_', " ") == PRODUCT)
        }
        _ => false,
    };
    Ok(ports.into_iter().filter(is_board).map(|port| port.port_name).collect())
}

fn open_error(name: &str, source: serialport::Error) -> LinkError {
    let port = name.to_owned();
    match source.kind() {
        serialport::ErrorKind::Io(ErrorKind::NotFound) => LinkError::Absent { port },
        serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => LinkError::Permission { port },
        // The kind of a port that another program has locked (EBUSY, flock).
        serialport::ErrorKind::NoDevice => LinkError::Busy { port },
        _ => match other_kind(Path::new(name)) {
            Some(kind) => LinkError::NotAPort { port, kind },
            None if is_no_terminal(&source) => LinkError::NotAPort { port, kind: "another device" },
            None => LinkError::Open { port, source },
        },
    }
}

/// Returns whether an error is that of a device without the functions of a serial port (ENOTTY),
/// which the crate `serialport` keeps as its text only.
fn is_no_terminal(error: &serialport::Error) -> bool {
    error.description == "Not a typewriter"
}

/// Returns what is at `path`, with its article, where that is no device.
fn other_kind(path: &Path) -> Option<&'static str> {
    let kind = fs::metadata(path).ok()?.file_type();
    let kinds = [
        (kind.is_file(), "a regular file"),
        (kind.is_dir(), "a folder"),
        (kind.is_socket(), "a socket"),
        (kind.is_fifo(), "a pipe"),
    ];
    kinds.into_iter().find_map(|(is_it, name)| is_it.then_some(name))
}

impl Transport for Serial {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let opened = self.opened;
        write_within(&mut self.port, bytes, WRITE_TIMEOUT, || opened.elapsed())
            .map_err(|error| self.lost(error))
    }

    fn receive(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        let mut buffer = [0; 1024];
        let waiting = self.port.bytes_to_read().map_err(|error| self.lost(error.into()))?;
        if waiting == 0 {
            if wait.is_zero() {
                return self.check_exists();
            }
            self.port.set_timeout(wait).map_err(|error| self.lost(error.into()))?;
        }
        let read = self.port.read(&mut buffer);
        let restored = self.port.set_timeout(WRITE_TIMEOUT);
        match read {
            Ok(0) => return Err(self.lost(ErrorKind::UnexpectedEof.into())),
            Ok(count) => bytes.extend_from_slice(&buffer[..count]),
            // A signal interrupts the wait: nothing has come.
            Err(error) if is_passing(&error) => {}
            Err(error) => return Err(self.lost(error)),
        }
        restored.map_err(|error| self.lost(error.into()))
    }
}

/// Writes all of `bytes` within `limit`, on the clock `now`. A single write may take its own
/// timeout beyond it.
fn write_within(
    port: &mut impl Write,
    mut bytes: &[u8],
    limit: Duration,
    now: impl Fn() -> Duration,
) -> std::io::Result<()> {
    let begin = now();
    while !bytes.is_empty() {
        match port.write(bytes) {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(count) => bytes = &bytes[count..],
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
        if !bytes.is_empty() && now().saturating_sub(begin) > limit {
            return Err(ErrorKind::TimedOut.into());
        }
    }
    Ok(())
}

/// Returns whether a read ended without bytes and without harm: by its timeout or a signal.
fn is_passing(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

impl Serial {
    /// Checks that the port still exists. A port that is gone may report for ever that there is
    /// nothing to read.
    fn check_exists(&self) -> Result<(), LinkError> {
        match std::fs::metadata(&self.name) {
            Ok(_) => Ok(()),
            Err(error) => Err(self.lost(error)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// Port whose other end takes a byte in 150 ms.
    struct Trickle<'a>(&'a Cell<Duration>);

    impl Write for Trickle<'_> {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            self.0.set(self.0.get() + Duration::from_millis(150));
            Ok(1)
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_reader_that_takes_single_bytes_does_not_hold_a_message_up() {
        let now = Cell::default();
        let write =
            |bytes: &[u8]| write_within(&mut Trickle(&now), bytes, WRITE_TIMEOUT, || now.get());
        let error = write(&[0; 256]).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::TimedOut);
        assert!(now.get() <= 2 * WRITE_TIMEOUT, "{:?}", now.get());
        write(&[0; 2]).unwrap();
    }
}
