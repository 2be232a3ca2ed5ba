//! Place where the senders of a stream connect.

use std::cell::RefCell;
use std::fs::{self, File};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::net::TcpListener;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use nix::sys::socket::{
    AddressFamily, Backlog, SockFlag, SockType, UnixAddr, bind, listen, socket,
};
use nix::sys::stat::{Mode, fchmod};
use tracing::debug;

use super::address::StreamAddress;
use super::connection::wait;
use super::error::StreamError;
use crate::error_chain::ErrorChain;

/// Place where the senders of a stream connect. Dropping it removes a Unix socket.
#[derive(Debug)]
pub struct Endpoint {
    kind: Kind,
    /// Connection that was accepted while another one was connected, and is the next one.
    pub(super) kept: RefCell<Option<File>>,
}

#[derive(Debug)]
enum Kind {
    /// Unix domain socket.
    Unix { listener: UnixListener, path: PathBuf },
    /// TCP port.
    Tcp(TcpListener),
    /// Standard input, which is the only sender.
    Input,
}

impl Endpoint {
    /// Listens at `address`. A Unix socket has mode 0600: only this user reaches it. One that a
    /// killed program has left behind is replaced.
    ///
    /// # Errors
    /// Where the address is in use or the operating system refuses it; where the standard input is
    /// a terminal.
    pub fn listen(address: &StreamAddress) -> Result<Self, StreamError> {
        let failure = |error: io::Error| match error.kind() {
            ErrorKind::AddrInUse => StreamError::InUse { address: address.to_string() },
            _ => StreamError::Listen { address: address.to_string(), error },
        };
        let kind = match address {
            StreamAddress::Unix(path) => {
                remove_left_behind(path).map_err(failure)?;
                let listener = bind_private(path).map_err(failure)?;
                Kind::Unix { listener, path: path.clone() }
            }
            StreamAddress::Tcp(address) => {
                let listener = TcpListener::bind(address).map_err(failure)?;
                listener.set_nonblocking(true).map_err(failure)?;
                Kind::Tcp(listener)
            }
            StreamAddress::StandardInput if io::stdin().is_terminal() => {
                return Err(StreamError::Terminal);
            }
            StreamAddress::StandardInput => Kind::Input,
        };
        Ok(Self { kind, kept: RefCell::default() })
    }

    /// Returns the handle that is readable when a sender waits; `None` for standard input.
    pub(super) fn listener(&self) -> Option<BorrowedFd<'_>> {
        match &self.kind {
            Kind::Unix { listener, .. } => Some(listener.as_fd()),
            Kind::Tcp(listener) => Some(listener.as_fd()),
            Kind::Input => None,
        }
    }

    /// Returns whether standard input is the only sender.
    pub fn is_input(&self) -> bool {
        self.listener().is_none()
    }

    /// Waits for a sender, for a tenth of a second at most. Returns its connection, if one has
    /// come.
    ///
    /// # Errors
    /// Where the operating system reports one.
    pub fn next_connection(&self) -> io::Result<Option<File>> {
        if let Some(kept) = self.kept.take() {
            return Ok(Some(kept));
        }
        wait(&[self.listener()])?;
        self.accept()
    }

    /// Keeps a connection that was accepted as the next one.
    pub(super) fn keep(&self, connection: File) {
        *self.kept.borrow_mut() = Some(connection);
    }

    /// Returns the connection of a sender that waits, or standard input; `None` where no sender
    /// waits.
    ///
    /// # Errors
    /// Where the operating system reports one.
    pub(super) fn accept(&self) -> io::Result<Option<File>> {
        let accepted = match &self.kind {
            Kind::Unix { listener, .. } => listener.accept().map(|(it, _)| OwnedFd::from(it)),
            Kind::Tcp(listener) => listener.accept().map(|(it, _)| OwnedFd::from(it)),
            Kind::Input => io::stdin().as_fd().try_clone_to_owned(),
        };
        match accepted {
            Ok(connection) => Ok(Some(File::from(connection))),
            // A sender that has gone before it was accepted.
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::WouldBlock | ErrorKind::ConnectionAborted | ErrorKind::Interrupted
                ) =>
            {
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// Sends the reason of a refusal to a sender, as a line of JSON. Standard input gets none.
    pub(super) fn refuse(&self, mut connection: &File, reason: &str) {
        if self.listener().is_some() {
            let line = format!("{}\n", serde_json::json!({ "error": reason }));
            if let Err(error) = connection.write_all(line.as_bytes()) {
                debug!(error = %ErrorChain(&error), "the refused sender has gone");
            }
        }
    }
}

impl Drop for Endpoint {
    fn drop(&mut self) {
        if let Kind::Unix { path, .. } = &self.kind {
            let _removed_by_another = fs::remove_file(path);
        }
    }
}

/// Listens at a Unix socket of mode 0600. The socket has the mode before it has a path, and Linux
/// gives it to the file at the path: there is no moment in which another user can connect.
fn bind_private(path: &Path) -> io::Result<UnixListener> {
    let flags = SockFlag::SOCK_CLOEXEC | SockFlag::SOCK_NONBLOCK;
    let socket = socket(AddressFamily::Unix, SockType::Stream, flags, None)?;
    fchmod(&socket, Mode::S_IRUSR | Mode::S_IWUSR)?;
    bind(socket.as_raw_fd(), &UnixAddr::new(path)?)?;
    listen(&socket, Backlog::MAXCONN)?;
    Ok(UnixListener::from(socket))
}

/// Removes a Unix socket at which no program listens.
fn remove_left_behind(path: &Path) -> io::Result<()> {
    let Ok(data) = fs::symlink_metadata(path) else { return Ok(()) };
    if !data.file_type().is_socket() {
        return Err(io::Error::new(ErrorKind::AlreadyExists, "the path exists and is no socket"));
    }
    let is_refused = |error: io::Error| error.kind() == ErrorKind::ConnectionRefused;
    if UnixStream::connect(path).is_err_and(is_refused) {
        fs::remove_file(path)?;
    }
    Ok(())
}
