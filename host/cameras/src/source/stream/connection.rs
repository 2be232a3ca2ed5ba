//! Connection of a sender, with deadlines, and the rules for those that connect meanwhile.

use std::fs::File;
use std::io::{self, Read};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd};
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::socket::{MsgFlags, recv};
use thiserror::Error;
use tracing::warn;

use super::endpoint::Endpoint;
use crate::bounded_read::excerpt;

/// Time without a byte after which a sender is not alive: within a frame its connection ends, and
/// elsewhere it gives way to another sender.
pub(super) const SILENCE: Duration = Duration::from_secs(2);

/// Byte that every documented stream begins with: that of a JSON object. What a browser sends first
/// begins with another one: the method of a request (HTTP, also with an upgrade to WebSocket), 22
/// (TLS) or 0 (STUN and TURN).
const BEGINNING: u8 = b'{';

/// Longest wait of one call into the operating system, ms: the reaction time to a closed stream.
const POLL_MS: u16 = 100;

/// Reason for a refusal while a sender is alive.
const OCCUPIED: &str = "another sender is connected; Plumb listens to one";

/// Reason why a [`Connection`] cannot be read on, beside the errors of the operating system.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Interruption {
    /// The stream is closed.
    #[error("the stream is closed")]
    Closed,
    /// The sender has stopped within a frame.
    #[error("the sender has stopped for {} s", SILENCE.as_secs())]
    Stalled,
    /// The sender is silent, and another one has begun to send.
    #[error(
        "the sender has sent nothing for {} s, and another one has connected",
        SILENCE.as_secs()
    )]
    GaveWay,
    /// The first byte on a socket is none of a stream.
    #[error("it begins with {0:?}")]
    Stranger(String),
}

impl Interruption {
    /// Returns the interruption that `error` stands for; `None` for an error of the operating
    /// system.
    pub fn of(error: &io::Error) -> Option<&Self> {
        error.get_ref()?.downcast_ref()
    }
}

impl From<Interruption> for io::Error {
    fn from(interruption: Interruption) -> Self {
        Self::other(interruption)
    }
}

/// Connection of a sender. A read fails with an [`Interruption`] where the stream is closed, where
/// the sender stops within a frame, where the first byte on a socket begins no stream, and where
/// another sender begins while this one is silent.
///
/// Meanwhile it refuses other senders: all that connect while this one is alive, and those that
/// begin with no stream. One that connects while this one is silent is a candidate. It replaces
/// this one with its first byte, and is refused if this one sends again before.
pub struct Connection<'a> {
    file: File,
    endpoint: &'a Endpoint,
    is_closed: &'a dyn Fn() -> bool,
    /// Whether the sender is within a frame.
    pub(super) is_in_frame: bool,
    /// Whether a byte has come.
    has_begun: bool,
    /// When the sender connected, or when its last bytes came.
    last_byte: Instant,
    candidate: Option<Candidate>,
}

/// Sender that has connected while another one is silent.
struct Candidate {
    file: File,
    since: Instant,
}

impl Read for Connection<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let begin = Instant::now();
        loop {
            if (self.is_closed)() {
                return Err(Interruption::Closed.into());
            }
            let candidate = self.candidate.as_ref().map(|candidate| candidate.file.as_fd());
            let handles = [Some(self.file.as_fd()), candidate, self.endpoint.listener()];
            let [own, candidate, newcomer] = wait(&handles)?;
            if own {
                let count = self.receive(buffer)?;
                if newcomer || self.candidate.is_some() {
                    self.refuse_others(newcomer);
                }
                return Ok(count);
            }
            if candidate {
                self.judge_candidate()?;
            } else if newcomer {
                self.meet_newcomer()?;
            }
            if self.is_in_frame && begin.elapsed() >= SILENCE {
                return Err(Interruption::Stalled.into());
            }
        }
    }
}

impl<'a> Connection<'a> {
    /// Returns the connection of a sender that `endpoint` has accepted. `is_closed` returns whether
    /// the stream is closed.
    pub fn new(file: File, endpoint: &'a Endpoint, is_closed: &'a dyn Fn() -> bool) -> Self {
        Self {
            file,
            endpoint,
            is_closed,
            is_in_frame: false,
            has_begun: false,
            last_byte: Instant::now(),
            candidate: None,
        }
    }

    /// Sends the reason of a refusal to the sender, as a line of JSON. Standard input gets none.
    pub fn refuse(&self, reason: &str) {
        self.endpoint.refuse(&self.file, reason);
    }

    /// Reads what has come.
    fn receive(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        let Some(&first) = buffer[..count].first() else { return Ok(0) };
        if !self.has_begun && first != BEGINNING && !self.endpoint.is_input() {
            return Err(Interruption::Stranger(beginning(&buffer[..count])).into());
        }
        (self.has_begun, self.last_byte) = (true, Instant::now());
        Ok(count)
    }

    /// Refuses the candidate, and the sender that connects where there is one. Where this sender
    /// has closed, or bytes wait that may be its last ones, they wait.
    fn refuse_others(&mut self, is_another_connecting: bool) {
        if peek(&self.file, &mut [0]) != Err(Errno::EAGAIN) {
            return;
        }
        if let Some(candidate) = self.candidate.take() {
            self.refuse_another(&candidate.file);
        }
        if is_another_connecting && let Ok(Some(file)) = self.endpoint.accept() {
            self.refuse_another(&file);
        }
    }

    fn refuse_another(&self, file: &File) {
        warn!("another sender was refused: {OCCUPIED}");
        self.endpoint.refuse(file, OCCUPIED);
    }

    /// Handles a sender that connects while this one sends nothing: it becomes the candidate where
    /// neither this one nor the candidate is alive.
    fn meet_newcomer(&mut self) -> io::Result<()> {
        let Some(file) = self.endpoint.accept()? else { return Ok(()) };
        let now = Instant::now();
        let is_alive = |since: Instant| now.saturating_duration_since(since) < SILENCE;
        let another = self.candidate.as_ref().is_some_and(|it| is_alive(it.since));
        if another || is_alive(self.last_byte) {
            self.refuse_another(&file);
        } else if let Some(before) = self.candidate.replace(Candidate { file, since: now }) {
            self.endpoint.refuse(&before.file, &Interruption::GaveWay.to_string());
        }
        Ok(())
    }

    /// Looks at the first bytes of the candidate, and leaves them there.
    ///
    /// # Errors
    /// [`Interruption::GaveWay`] where they begin a stream.
    fn judge_candidate(&mut self) -> io::Result<()> {
        let Some(Candidate { file, .. }) = &self.candidate else { return Ok(()) };
        let mut bytes = [0; 256];
        match peek(file, &mut bytes) {
            Ok(1..) if bytes[0] == BEGINNING => return Err(Interruption::GaveWay.into()),
            Ok(count @ 1..) => {
                let stranger = Interruption::Stranger(beginning(&bytes[..count]));
                warn!("another sender was refused: {stranger}");
                self.endpoint.refuse(file, &stranger.to_string());
            }
            Err(Errno::EINTR | Errno::EAGAIN) => return Ok(()),
            // It has gone.
            Ok(_) | Err(_) => {}
        }
        self.candidate = None;
        Ok(())
    }
}

impl Drop for Connection<'_> {
    /// Leaves the candidate as the next sender.
    fn drop(&mut self) {
        if let Some(candidate) = self.candidate.take() {
            self.endpoint.keep(candidate.file);
        }
    }
}

/// Returns the first line of what a stranger sent, to be quoted.
fn beginning(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| b"\r\n".contains(byte)).unwrap_or(bytes.len());
    excerpt(&String::from_utf8_lossy(&bytes[..end]))
}

/// Copies bytes that have come on a socket, and leaves them there. Does not wait. Returns their
/// number; 0 where the other side has closed.
fn peek(socket: &File, buffer: &mut [u8]) -> nix::Result<usize> {
    recv(socket.as_raw_fd(), buffer, MsgFlags::MSG_PEEK | MsgFlags::MSG_DONTWAIT)
}

/// Waits until one of the handles is readable or has ended, for [`POLL_MS`] at most. Returns which
/// are.
pub(super) fn wait<const N: usize>(handles: &[Option<BorrowedFd<'_>>; N]) -> io::Result<[bool; N]> {
    let mut present: Vec<PollFd<'_>> =
        handles.iter().flatten().map(|&fd| PollFd::new(fd, PollFlags::POLLIN)).collect();
    match poll(&mut present, PollTimeout::from(POLL_MS)) {
        Ok(_) | Err(Errno::EINTR) => {}
        Err(error) => return Err(error.into()),
    }
    let mut results = present.iter().map(|fd| fd.any().unwrap_or(false));
    Ok(handles.map(|handle| handle.is_some() && results.next().unwrap_or(false)))
}

#[cfg(test)]
mod tests;
