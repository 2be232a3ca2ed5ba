//! Board's end of a pseudo-terminal: a virtual serial port.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use nix::fcntl::OFlag;
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use rustix::termios::ioctl_tiocnxcl;

/// Folder at which the file system of the pseudo-terminals is mounted.
const TERMINALS: &str = "/dev/pts";

/// Board's end of a pseudo-terminal. A host opens the other end by its [`path`](Self::path) like
/// any serial port. Dropping the terminal looks like an unplugged board to a host.
pub struct Terminal {
    board_end: File,
    path: PathBuf,
    /// Kept open so that the terminal keeps its mode between two hosts.
    host_end: File,
}

impl Terminal {
    /// Opens a new pseudo-terminal in raw mode.
    ///
    /// # Errors
    /// Errors of the operating system: no pseudo-terminal is left, or none is mounted.
    pub fn open() -> io::Result<Self> {
        Self::open_new().map_err(|error| unmounted(error, Path::new(TERMINALS)))
    }

    fn open_new() -> io::Result<Self> {
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
        Ok(Self { board_end, path, host_end })
    }

    /// Returns the path that a host opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the bytes that have arrived from the host, without waiting. Returns their number,
    /// which may be 0.
    ///
    /// It also lets the next host in. A host claims a serial port for itself (TIOCEXCL), and Linux
    /// ends the claim of a host that was killed when nobody has the port open any more; this
    /// terminal has that end open, too. Two hosts are kept apart by their lock on the file (flock).
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        ioctl_tiocnxcl(&self.host_end)?;
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

/// Returns the error to open a pseudo-terminal. Where their file system is not mounted at
/// `terminals`, its text says how to mount it.
fn unmounted(error: io::Error, terminals: &Path) -> io::Error {
    if terminals.join("ptmx").symlink_metadata().is_ok() {
        return error;
    }
    let terminals = terminals.display();
    let text = format!(
        "no pseudo-terminal can be opened: nothing is mounted at {terminals}. As root: \
         `mkdir -p {terminals} && mount -t devpts -o ptmxmode=666 devpts {terminals} && \
         ln -sf pts/ptmx /dev/ptmx`"
    );
    io::Error::new(error.kind(), text)
}

/// Opens the host's end at `path`.
fn open_terminal(path: &Path) -> io::Result<File> {
    use std::os::unix::fs::OpenOptionsExt;
    OpenOptions::new().read(true).write(true).custom_flags(OFlag::O_NOCTTY.bits()).open(path)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

    use std::fs::{Permissions, set_permissions};
    use std::os::unix::fs::PermissionsExt;
    use std::os::unix::process::CommandExt;
    use std::process::{Command, Stdio};

    use nix::unistd::geteuid;
    use rustix::termios::ioctl_tiocexcl;

    use super::*;

    /// A user without privileges: nobody.
    const NOBODY: u32 = 65_534;

    /// Returns whether a user who is not root can open the terminal at `path`. Root is never
    /// refused.
    fn is_open_to_a_user(path: &Path) -> bool {
        let mut shell = Command::new("sh");
        shell.args(["-c", ": 3<>\"$0\""]).arg(path);
        shell.stderr(Stdio::null());
        if geteuid().is_root() {
            shell.uid(NOBODY);
        }
        shell.status().unwrap().success()
    }

    #[test]
    fn a_missing_file_system_of_terminals_is_named_with_the_way_to_mount_it() {
        let error = || io::Error::from(io::ErrorKind::NotFound);
        let absent = unmounted(error(), Path::new("/no/pts")).to_string();
        assert!(absent.contains("nothing is mounted at /no/pts. As root: `mkdir"), "{absent}");
        assert_eq!(unmounted(error(), Path::new(TERMINALS)).to_string(), error().to_string());
    }

    #[test]
    fn the_terminal_is_open_to_the_next_host_after_one_was_killed() {
        let mut terminal = Terminal::open().unwrap();
        let path = terminal.path().to_owned();
        set_permissions(&path, Permissions::from_mode(0o666)).unwrap();
        let host = open_terminal(&path).unwrap();
        ioctl_tiocexcl(&host).unwrap();
        // As after `kill -9`: the file is closed, and the claim stays.
        drop(host);
        assert!(!is_open_to_a_user(&path), "the claim of the host that was killed does not stay");
        assert_eq!(terminal.read(&mut [0; 16]).unwrap(), 0);
        assert!(is_open_to_a_user(&path));
    }
}
