//! Place where the senders of a stream connect.

use std::cell::RefCell;
use std::fs::{self, File};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::net::TcpListener;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::socket::{
    AddressFamily, Backlog, SockFlag, SockType, UnixAddr, bind, listen, socket,
};
use nix::sys::stat::{Mode, fchmod};
use plumb_config::error_chain::ErrorChain;
use tracing::{debug, warn};

use super::address::StreamAddress;
use super::arrival::{Arrival, MAX_WAITING, WaitingRoom};
use super::error::StreamError;

/// Longest wait of one call into the operating system, ms: the reaction time to a closed stream.
const POLL_MS: u16 = 100;

/// Place where the senders of a stream connect. Dropping it removes a Unix socket.
#[derive(Debug)]
pub struct Endpoint {
    kind: Kind,
    waiting: RefCell<WaitingRoom>,
}

/// What a wait has found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Ready {
    /// Whether the sender is readable, or has ended.
    pub(super) sender: bool,
    /// Whether there are others: connections that wait, or are to be accepted.
    pub(super) others: bool,
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
        Ok(Self { kind, waiting: RefCell::default() })
    }

    /// Returns the handle that is readable when somebody connects; `None` for standard input.
    fn listener(&self) -> Option<BorrowedFd<'_>> {
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

    /// Waits for a connection that begins to send, for a tenth of a second at most. Returns it, if
    /// there is one. Standard input is a sender at once.
    ///
    /// # Errors
    /// Where the operating system reports one.
    pub fn next_arrival(&self) -> io::Result<Option<Arrival>> {
        if self.is_input() {
            return Ok(self.accept()?.map(Arrival::Sender));
        }
        self.wait(None)?;
        self.arrival()
    }

    /// Waits until somebody connects, begins to send or ends, for [`POLL_MS`] at most. Returns what
    /// it has found of `sender` and of others.
    pub(super) fn wait(&self, sender: Option<&File>) -> io::Result<Ready> {
        let waiting = self.waiting.borrow();
        let own = sender.map(AsFd::as_fd).into_iter();
        let others = self.listener().into_iter().chain(waiting.handles());
        let mut handles: Vec<PollFd<'_>> =
            own.chain(others).map(|fd| PollFd::new(fd, PollFlags::POLLIN)).collect();
        match poll(&mut handles, PollTimeout::from(POLL_MS)) {
            Ok(_) | Err(Errno::EINTR) => {}
            Err(error) => return Err(error.into()),
        }
        let mut found = handles.iter().map(|handle| handle.any().unwrap_or(false));
        let sender = sender.is_some() && found.next().unwrap_or(false);
        Ok(Ready { sender, others: !waiting.is_empty() || found.any(|it| it) })
    }

    /// Returns a connection that has begun to send, of those that wait and those that connect.
    ///
    /// # Errors
    /// Where the operating system reports one.
    pub(super) fn arrival(&self) -> io::Result<Option<Arrival>> {
        let mut waiting = self.waiting.borrow_mut();
        let arrival = waiting.next_that_sends();
        if arrival.is_some() || self.is_input() {
            return Ok(arrival);
        }
        // No more at once, however many connect.
        for _ in 0..MAX_WAITING {
            let Some(connection) = self.accept()? else { break };
            if let Some(oldest) = waiting.add(connection) {
                self.refuse(&oldest, "others have connected, and this connection sends nothing");
            }
        }
        Ok(waiting.next_that_sends())
    }

    /// Puts a connection back: it is the next arrival.
    pub(super) fn put_back(&self, connection: File) {
        self.waiting.borrow_mut().put_back(connection);
    }

    /// Refuses those that wait, and the next one that connects.
    ///
    /// # Errors
    /// Where the operating system reports one.
    pub(super) fn refuse_others(&self, reason: &str) -> io::Result<()> {
        let waiting = self.waiting.borrow_mut().clear();
        let newcomer = if self.is_input() { None } else { self.accept()? };
        for other in waiting.iter().chain(&newcomer) {
            warn!("another sender was refused: {reason}");
            self.refuse(other, reason);
        }
        Ok(())
    }

    /// Returns the connection of a sender that waits, or standard input; `None` where no sender
    /// waits.
    ///
    /// # Errors
    /// Where the operating system reports one.
    fn accept(&self) -> io::Result<Option<File>> {
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
    pub fn refuse(&self, mut connection: &File, reason: &str) {
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
