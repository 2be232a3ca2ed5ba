//! Pseudo-terminal: a virtual serial port.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::path::{Path, PathBuf};

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Board's end of a pseudo-terminal. A host opens the other end by its [`path`](Self::path) like
/// any serial port. Dropping the terminal looks like an unplugged board to a host.
pub struct Terminal {
    board_end: File,
    path: PathBuf,
    /// Kept open so that the terminal keeps its mode between two hosts.
    _host_end: File,
}

impl Terminal {
    /// Opens a new pseudo-terminal in raw mode.
    ///
    /// # Errors
    /// Errors of the operating system: no pseudo-terminal is left, or none is mounted.
    pub fn open() -> io::Result<Self> {
        let board_end: OwnedFd =
            openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&board_end)?;
        unlockpt(&board_end)?;
        let path = ptsname(&board_end, Vec::new())?;
        let path = PathBuf::from(path.to_string_lossy().into_owned());
        let host_end = open_terminal(&path)?;
        let mut mode = tcgetattr(host_end.as_fd())?;
        mode.make_raw();
        tcsetattr(host_end.as_fd(), OptionalActions::Now, &mode)?;
        let flags = fcntl_getfl(&board_end)?;
        fcntl_setfl(&board_end, flags | OFlags::NONBLOCK)?;
        Ok(Self { board_end: File::from(board_end), path, _host_end: host_end })
    }

    /// Returns the path that a host opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the bytes that have arrived from the host, without waiting. Returns their number,
    /// which may be 0.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.board_end.read(buffer) {
            Err(e) if e.kind() == ErrorKind::WouldBlock => Ok(0),
            other => other,
        }
    }

    /// Sends `bytes` to the host without waiting. Bytes that do not fit the terminal's buffer,
    /// because no host reads it, are lost.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self.board_end.write_all(bytes) {
            Err(e) if e.kind() == ErrorKind::WouldBlock => Ok(()),
            other => other,
        }
    }
}

/// Opens the host's end at `path`.
fn open_terminal(path: &Path) -> io::Result<File> {
    use std::os::unix::fs::OpenOptionsExt;
    let flags = OFlags::NOCTTY.bits() as i32;
    OpenOptions::new().read(true).write(true).custom_flags(flags).open(path)
}
