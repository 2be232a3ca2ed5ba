//! Transport of bytes between host and board, over a serial port here, and the programs that have
//! the port open.

use std::ffi::OsStr;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use std::time::{Duration, Instant};
use std::{fmt, fs};

use plumb_config::book::page;
use serialport::{ClearBuffer, SerialPort, SerialPortInfo, SerialPortType, TTYPort};

use super::LinkError;

/// Byte stream to the board and back.
pub trait Transport {
    /// Returns the name of the transport, for errors.
    fn name(&self) -> String;

    /// Returns the time on the link's clock, which never runs backwards: real time, or the virtual
    /// time of an emulated board. All timeouts of a link are measured on it.
    fn now(&self) -> Duration;

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

/// Returns whether the terminal at `path`, which may be a link, is a pseudo-terminal, or was one
/// until its program ended.
pub fn is_pseudo_terminal(path: &Path) -> bool {
    let target = path.canonicalize().or_else(|_| path.read_link());
    target.is_ok_and(|path| path.starts_with("/dev/pts"))
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
        serialport::ErrorKind::NoDevice => LinkError::Busy { users: PortUsers::of(name), port },
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

/// Folder of the running processes.
const PROC: &str = "/proc";

/// A process that has the port open.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct PortUser {
    /// Number of the process.
    pub pid: u32,
    /// Name of its program, as the kernel keeps it: 15 bytes at most.
    pub name: String,
}

/// Programs that have a port open, as far as this user may see. Displayed as the part of a message
/// that names them and says what to do.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PortUsers(Vec<PortUser>);

impl PortUsers {
    /// Finds the programs that have `port` open, without the one at the other end of a
    /// pseudo-terminal. Those of other users are found by root only.
    pub(super) fn of(port: &str) -> Self {
        Self::within(Path::new(PROC), Path::new(port))
    }

    fn within(processes: &Path, port: &Path) -> Self {
        let (Ok(entries), Ok(port)) = (fs::read_dir(processes), port.canonicalize()) else {
            return Self::default();
        };
        let user = |folder: &Path| {
            let pid = folder.file_name()?.to_str()?.parse().ok()?;
            let files = || fs::read_dir(folder.join("fd")).ok().into_iter().flatten().flatten();
            let is_port = |path: &Path| fs::read_link(path).is_ok_and(|target| target == port);
            files().find(|file| is_port(&file.path()))?;
            // An emulated board has both ends of its pseudo-terminal open.
            if files().any(|file| is_other_end(folder, &file.file_name(), &port)) {
                return None;
            }
            let name = fs::read_to_string(folder.join("comm")).unwrap_or_default();
            Some(PortUser { pid, name: name.trim_end().to_owned() })
        };
        let mut users: Vec<_> = entries.flatten().filter_map(|entry| user(&entry.path())).collect();
        users.sort();
        Self(users)
    }

    fn has(&self, name: &str) -> bool {
        self.0.iter().any(|user| user.name == name)
    }
}

/// Returns whether the file `number` of the process `folder` is the other end of the
/// pseudo-terminal `port`.
fn is_other_end(folder: &Path, number: &OsStr, port: &Path) -> bool {
    let Ok(index) = port.strip_prefix("/dev/pts") else { return false };
    let target = fs::read_link(folder.join("fd").join(number)).unwrap_or_default();
    let info = || fs::read_to_string(folder.join("fdinfo").join(number)).unwrap_or_default();
    let is_index = |line: &str| {
        line.strip_prefix("tty-index:").is_some_and(|it| Path::new(it.trim()) == index)
    };
    target.ends_with("ptmx") && info().lines().any(is_index)
}

impl fmt::Display for PortUsers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return write!(
                f,
                ", of another user: `sudo fuser -v` with the port's name shows which. Close it; \
                 ModemManager lets go by itself after some seconds, and leaves the board alone \
                 where its udev rule is installed ({}, \"The port\")",
                page("board")
            );
        }
        let names: Vec<_> =
            self.0.iter().map(|PortUser { pid, name }| format!("{name}, process {pid}")).collect();
        write!(f, " ({})", names.join("; "))?;
        if !self.has("ModemManager") {
            f.write_str("; close it first")?;
            let how = if self.has("plumb") { " (Ctrl-C there, or End on its page)" } else { "" };
            return f.write_str(how);
        }
        write!(
            f,
            ": it asks whether the board is a modem. Wait some seconds, and install the board's \
             udev rule ({}, \"The port\")",
            page("board")
        )
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::os::unix::fs::symlink;

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

    #[test]
    fn a_pseudo_terminal_is_known_by_its_path_also_behind_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let (terminal, file) = (folder.path().join("board"), folder.path().join("file"));
        symlink("/dev/pts", &terminal).unwrap();
        fs::write(&file, "").unwrap();
        assert!(is_pseudo_terminal(&terminal));
        assert!(!is_pseudo_terminal(&file) && !is_pseudo_terminal(Path::new("/dev/null")));
    }

    /// Adds a process that has `file` open.
    fn add(processes: &Path, pid: &str, name: &str, file: &Path) {
        let folder = processes.join(pid);
        fs::create_dir_all(folder.join("fd")).unwrap();
        fs::write(folder.join("comm"), format!("{name}\n")).unwrap();
        symlink("/dev/null", folder.join("fd/0")).unwrap();
        symlink(file, folder.join("fd/3")).unwrap();
    }

    #[test]
    fn the_programs_that_have_the_port_open_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().canonicalize().unwrap();
        let (processes, port, by_id) = (path.join("proc"), path.join("tty"), path.join("by-id"));
        fs::write(&port, "").unwrap();
        symlink(&port, &by_id).unwrap();
        add(&processes, "70", "minicom", &port);
        add(&processes, "8", "plumb", &port);
        add(&processes, "9", "editor", &path.join("other"));
        add(&processes, "self", "plumb", &port);
        fs::create_dir_all(processes.join("10")).unwrap();
        for name in [&port, &by_id] {
            let users = PortUsers::within(&processes, name).to_string();
            let expected = " (plumb, process 8; minicom, process 70); close it first (Ctrl-C \
                            there, or End on its page)";
            assert_eq!(users, expected);
        }
        add(&processes, "71", "ModemManager", &port);
        let users = PortUsers::within(&processes, &port).to_string();
        assert!(users.contains("whether the board is a modem"), "{users}");
    }

    #[test]
    fn the_other_end_of_a_pseudo_terminal_is_known_by_its_number() {
        let folder = tempfile::tempdir().unwrap();
        let process = folder.path();
        fs::create_dir(process.join("fd")).unwrap();
        fs::create_dir(process.join("fdinfo")).unwrap();
        for (number, target, index) in [("3", "/dev/pts/ptmx", "7"), ("4", "/dev/pts/7", "7")] {
            symlink(target, process.join("fd").join(number)).unwrap();
            let info = format!("pos:\t0\nflags:\t02\ntty-index:\t{index}\n");
            fs::write(process.join("fdinfo").join(number), info).unwrap();
        }
        let is_end =
            |number: &str, port: &str| is_other_end(process, OsStr::new(number), Path::new(port));
        assert!(is_end("3", "/dev/pts/7"));
        for (number, port) in [("3", "/dev/pts/8"), ("4", "/dev/pts/7"), ("3", "/dev/ttyACM0")] {
            assert!(!is_end(number, port), "{number} {port}");
        }
    }

    #[test]
    fn of_programs_of_other_users_the_message_says_how_to_see_them() {
        let folder = tempfile::tempdir().unwrap();
        let users = PortUsers::within(folder.path(), Path::new("/dev/null")).to_string();
        assert!(users.contains("sudo fuser"), "{users}");
        let users = PortUsers::within(&folder.path().join("absent"), Path::new("/dev/null"));
        assert_eq!(users, PortUsers::default());
    }

    #[test]
    fn this_process_is_found_by_the_file_that_it_has_open() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let users = PortUsers::of(file.path().to_str().unwrap());
        assert_eq!(users.0.iter().map(|user| user.pid).collect::<Vec<_>>(), [std::process::id()]);
    }
}
