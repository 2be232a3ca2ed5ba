//! Connections before their first byte, which tells senders from strangers.

use std::collections::VecDeque;
use std::fs::File;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd};
use std::time::Duration;

use nix::errno::Errno;
use nix::sys::socket::{MsgFlags, recv};
use plumb_config::bounded_read::excerpt;
use thiserror::Error;

/// Time without a byte after which a sender is not alive: within a frame its connection ends, and
/// elsewhere it gives way to another sender.
pub(super) const SILENCE: Duration = Duration::from_secs(2);

/// Byte that every documented stream begins with: that of a JSON object. What a browser sends first
/// begins with another one: the method of a request (HTTP, also with an upgrade to WebSocket), 22
/// (TLS) or 0 (STUN and TURN).
const BEGINNING: u8 = b'{';

/// Connections that may wait. One more ends the oldest.
pub(super) const MAX_WAITING: usize = 8;

/// Bytes of a stranger that are looked at.
const MAX_PEEKED: usize = 256;

/// Connection that has begun to send.
#[derive(Debug)]
pub enum Arrival {
    /// A sender: its first byte is that of a stream.
    Sender(File),
    /// Anybody else, to be refused with the reason.
    Stranger(File, Stranger),
}

/// First line of something that is no stream.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("it begins with {0:?}")]
pub struct Stranger(String);

/// Connections that have sent nothing, the oldest first.
#[derive(Debug, Default)]
pub(super) struct WaitingRoom(VecDeque<File>);

impl WaitingRoom {
    /// Returns the handles, which are readable when a connection begins to send or ends.
    pub(super) fn handles(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.0.iter().map(AsFd::as_fd)
    }

    /// Returns whether nobody waits.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds a connection. Returns the oldest one where there is no room for both.
    pub(super) fn add(&mut self, connection: File) -> Option<File> {
        self.0.push_back(connection);
        if self.0.len() > MAX_WAITING { self.0.pop_front() } else { None }
    }

    /// Puts a connection back as the first one.
    pub(super) fn put_back(&mut self, connection: File) {
        self.0.push_front(connection);
    }

    /// Removes and returns a connection that has begun to send; its bytes stay in it. Those that
    /// have closed are removed, too.
    pub(super) fn next_that_sends(&mut self) -> Option<Arrival> {
        let mut bytes = [0; MAX_PEEKED];
        let mut index = 0;
        while let Some(connection) = self.0.get(index) {
            match peek(connection, &mut bytes) {
                Err(Errno::EAGAIN | Errno::EINTR) => index += 1,
                Ok(count @ 1..) => {
                    let connection = self.0.remove(index)?;
                    return Some(if bytes[0] == BEGINNING {
                        Arrival::Sender(connection)
                    } else {
                        Arrival::Stranger(connection, Stranger::of(&bytes[..count]))
                    });
                }
                Ok(_) | Err(_) => drop(self.0.remove(index)),
            }
        }
        None
    }

    /// Removes and returns all connections.
    pub(super) fn clear(&mut self) -> VecDeque<File> {
        std::mem::take(&mut self.0)
    }
}

impl Stranger {
    /// Returns the stranger that has sent `bytes`.
    fn of(bytes: &[u8]) -> Self {
        let end = bytes.iter().position(|byte| b"\r\n".contains(byte)).unwrap_or(bytes.len());
        Self(excerpt(&String::from_utf8_lossy(&bytes[..end])))
    }
}

/// Copies bytes that have come on a socket, and leaves them there. Does not wait. Returns their
/// number; 0 where the other side has closed.
pub(super) fn peek(socket: &File, buffer: &mut [u8]) -> nix::Result<usize> {
    recv(socket.as_raw_fd(), buffer, MsgFlags::MSG_PEEK | MsgFlags::MSG_DONTWAIT)
}
