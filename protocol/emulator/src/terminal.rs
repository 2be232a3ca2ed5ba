//! A pseudo-terminal: a serial port that is not there.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::path::{Path, PathBuf};

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// The board's end of a pseudo-terminal; hosts open the other end by its [`path`](Self::path) like
/// any serial port.
///
/// Dropping it is what pulling the plug is to a host.
pub struct Terminal {
    board_end: File,
    path: PathBuf,
    /// Kept open, so that the terminal stays as it is between two hosts.
    _host_end: File,
}

impl Terminal {
    /// Opens a new one in raw mode.
    ///
    /// # Errors
    /// What the operating system says: no pseudo-terminals left, or none mounted.
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

    /// The path that a host opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads what has come from the host, without waiting; the number of bytes, 0 where there are
    /// none.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.board_end.read(buffer) {
            Err(e) if e.kind() == ErrorKind::WouldBlock => Ok(0),
            other => other,
        }
    }

    /// Sends `bytes` to the host, without waiting: what does not fit, since nobody reads it, is
    /// lost.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self.board_end.write_all(bytes) {
            Err(e) if e.kind() == ErrorKind::WouldBlock => Ok(()),
            other => other,
        }
    }
}

fn open_terminal(path: &Path) -> io::Result<File> {
    use std::os::unix::fs::OpenOptionsExt;
    let flags = OFlags::NOCTTY.bits() as i32;
    OpenOptions::new().read(true).write(true).custom_flags(flags).open(path)
}
