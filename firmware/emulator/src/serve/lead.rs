//! The time of a served board in the hands of its host: the board waits for the host, however slow
//! the computer is, and the host for the board.
//!
//! Beside its pseudo-terminal, which the host keeps open and locked, a served board listens at a
//! socket in Linux's abstract namespace. Each request of the host has the bytes for the board and a
//! time of the board's clock; the board runs to that time and answers with its clock and the bytes
//! for the host. Between two requests the board's time stands.

use std::io::{self, ErrorKind, Read, Write};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
use std::path::Path;
use std::time::{Duration, Instant};

use plumb_protocol::units::Micros;

use super::peer::Peer;

/// Longest time of the computer for which one program waits for the other. One that hangs, or is
/// stopped, is as silent as at the other end of a serial line.
const PATIENCE: Duration = Duration::from_secs(30);

/// Interval at which a program that waits looks whether the other is stopped.
const LOOK: Duration = Duration::from_millis(10);

/// Largest number of bytes in a message.
const BYTES_MAX: usize = 1 << 20;

/// What a host asks of the board.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Request {
    /// Time to which the board runs.
    pub(super) until: Micros,
    /// Whether the board stops where bytes for the host are waiting.
    pub(super) ends_with_bytes: bool,
    /// Bytes from the host.
    pub(super) bytes: Vec<u8>,
}

/// Answer of the board.
#[derive(Debug, PartialEq, Eq)]
pub struct Reply {
    /// Time on the board's clock.
    pub now: Micros,
    /// Bytes for the host.
    pub bytes: Vec<u8>,
}

/// Socket of a served board.
pub(super) struct LeadListener(UnixListener);

impl LeadListener {
    /// Listens for the hosts of the terminal at `path`.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let listener = UnixListener::bind_addr(&address(path)?)?;
        listener.set_nonblocking(true)?;
        Ok(Self(listener))
    }

    /// Returns the host that has come, without waiting.
    pub(super) fn accept(&self) -> io::Result<Option<LeadingHost>> {
        match self.0.accept() {
            Ok((stream, _)) => {
                stream.set_read_timeout(Some(PATIENCE))?;
                Ok(Some(LeadingHost { peer: Peer::of(stream), heard: Instant::now() }))
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(None),
            Err(error) => Err(error),
        }
    }
}

/// Host that has the time of the board.
pub(super) struct LeadingHost {
    peer: Peer,
    /// When it was heard last.
    heard: Instant,
}

impl LeadingHost {
    /// Returns whether the board waits for this host.
    pub(super) fn is_awaited(&self) -> bool {
        let silence = self.heard.elapsed();
        silence < LOOK || (silence < PATIENCE && !self.peer.is_stopped())
    }

    /// Returns the next request, if it begins within `wait`.
    ///
    /// # Errors
    /// Where the host has gone.
    pub(super) fn request(&mut self, wait: Duration) -> io::Result<Option<Request>> {
        if !self.peer.wait(wait)? {
            return Ok(None);
        }
        let mut kind = [0];
        self.peer.stream.read_exact(&mut kind)?;
        let (until, bytes) = read(&mut self.peer.stream)?;
        self.heard = Instant::now();
        Ok(Some(Request { until, ends_with_bytes: kind[0] != 0, bytes }))
    }

    /// Answers the last request.
    ///
    /// # Errors
    /// Where the host has gone.
    pub(super) fn answer(&mut self, reply: &Reply) -> io::Result<()> {
        self.heard = Instant::now();
        write(&mut self.peer.stream, &[], reply.now, &reply.bytes)
    }
}

/// Host's end: the time of a served board.
#[derive(Debug)]
pub struct BoardTime {
    peer: Peer,
    /// Whether an answer is due.
    is_due: bool,
}

impl BoardTime {
    /// Takes the time of the board at the terminal `path`, which may be a link; `None` where no
    /// board that is served there gives its time.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn of(path: &Path) -> io::Result<Option<Self>> {
        let Ok(path) = path.canonicalize() else { return Ok(None) };
        let Ok(stream) = UnixStream::connect_addr(&address(&path)?) else { return Ok(None) };
        stream.set_read_timeout(Some(PATIENCE))?;
        Ok(Some(Self { peer: Peer::of(stream), is_due: false }))
    }

    /// Sends the `bytes` to the board, which it takes out, and lets it run to `until`, or until
    /// bytes for the host wait if `ends_with_bytes`. Waits for that.
    ///
    /// Returns `None` where the board's program is stopped or hangs. The next call sends nothing,
    /// and waits for the same answer.
    ///
    /// # Errors
    /// Where the board has gone.
    pub fn run(
        &mut self,
        bytes: &mut Vec<u8>,
        until: Micros,
        ends_with_bytes: bool,
    ) -> io::Result<Option<Reply>> {
        if !self.is_due {
            write(&mut self.peer.stream, &[ends_with_bytes.into()], until, bytes)?;
            bytes.clear();
            self.is_due = true;
        }
        let begin = Instant::now();
        while !self.peer.wait(LOOK)? {
            if self.peer.is_stopped() || begin.elapsed() > PATIENCE {
                return Ok(None);
            }
        }
        let (now, bytes) = read(&mut self.peer.stream)?;
        self.is_due = false;
        Ok(Some(Reply { now, bytes }))
    }
}

/// Returns the address of the board at the terminal `path`.
fn address(path: &Path) -> io::Result<SocketAddr> {
    SocketAddr::from_abstract_name(format!("plumb-board-time{}", path.display()))
}

/// Writes a message: `kind`, then the time (u64) and the number of bytes (u32), both little-endian,
/// then the bytes.
fn write(stream: &mut UnixStream, kind: &[u8], time: Micros, bytes: &[u8]) -> io::Result<()> {
    let length = u32::try_from(bytes.len()).map_err(|_| ErrorKind::InvalidInput)?;
    let head = [kind, &time.0.to_le_bytes(), &length.to_le_bytes()].concat();
    stream.write_all(&[&head, bytes].concat())
}

/// Reads a message behind its kind.
fn read(stream: &mut UnixStream) -> io::Result<(Micros, Vec<u8>)> {
    let (mut time, mut length) = ([0; 8], [0; 4]);
    stream.read_exact(&mut time)?;
    stream.read_exact(&mut length)?;
    let length = u32::from_le_bytes(length) as usize;
    if length > BYTES_MAX {
        return Err(ErrorKind::InvalidData.into());
    }
    let mut bytes = vec![0; length];
    stream.read_exact(&mut bytes)?;
    Ok((Micros(u64::from_le_bytes(time)), bytes))
}
