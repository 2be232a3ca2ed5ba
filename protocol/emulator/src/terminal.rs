//! Pseudo-terminal: a virtual serial port.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use nix::fcntl::OFlag;
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

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
        let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_CLOEXEC | OFlag::O_NONBLOCK;
        let board_end = posix_openpt(flags)?;
        grantpt(&board_end)?;
        unlockpt(&board_end)?;
        let path = PathBuf::from(ptsname_r(&board_end)?);
        let host_end = open_terminal(&path)?;
        let mut mode = tcgetattr(&host_end)?;
        cfmakeraw(&mut mode);
        tcsetattr(&host_end, SetArg::TCSANOW, &mode)?;
        let board_end = File::from(OwnedFd::from(board_end));
        Ok(Self { board_end, path, _host_end: host_end })
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
    OpenOptions::new().read(true).write(true).custom_flags(OFlag::O_NOCTTY.bits()).open(path)
}
