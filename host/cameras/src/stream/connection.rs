//! Connection of a sender, with deadlines, and the rules for those that connect meanwhile.

use std::fs::File;
use std::io::{self, Read};
use std::time::Instant;

use nix::errno::Errno;
use thiserror::Error;
use tracing::warn;

use super::arrival::{Arrival, SILENCE, peek};
use super::endpoint::Endpoint;

/// Reason for a refusal while a sender is alive.
const OCCUPIED: &str = "another sender is connected; Plumb listens to one";

/// Reason why a [`Connection`] cannot be read on, beside the errors of the operating system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
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
}

impl Interruption {
    /// Returns the interruption that `error` stands for; `None` for an error of the operating
    /// system.
    pub fn of(error: &io::Error) -> Option<Self> {
        error.get_ref()?.downcast_ref().copied()
    }
}

impl From<Interruption> for io::Error {
    fn from(interruption: Interruption) -> Self {
        Self::other(interruption)
    }
}

/// Connection of a sender that has begun. A read fails with an [`Interruption`] where the stream is
/// closed, where the sender stops within a frame, and where another sender begins while this one is
/// silent.
///
/// Meanwhile it refuses all that connect while this one is alive, and strangers. One that connects
/// while this one is silent waits for its first byte or the next one of this sender.
pub struct Connection<'a> {
    file: File,
    endpoint: &'a Endpoint,
    is_closed: &'a dyn Fn() -> bool,
    /// Whether the sender is within a frame.
    pub(super) is_in_frame: bool,
    /// When the last bytes came.
    last_byte: Instant,
}

impl Read for Connection<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let begin = Instant::now();
        loop {
            if (self.is_closed)() {
                return Err(Interruption::Closed.into());
            }
            let ready = self.endpoint.wait(Some(&self.file))?;
            if ready.sender {
                return self.receive(buffer, ready.others);
            }
            if ready.others && self.last_byte.elapsed() < SILENCE {
                self.endpoint.refuse_others(OCCUPIED)?;
            } else if ready.others {
                self.look_for_another()?;
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
        Self { file, endpoint, is_closed, is_in_frame: false, last_byte: Instant::now() }
    }

    /// Sends the reason of a refusal to the sender, as a line of JSON. Standard input gets none.
    pub fn refuse(&self, reason: &str) {
        self.endpoint.refuse(&self.file, reason);
    }

    /// Reads what has come. Refuses others, unless the sender has closed, or bytes wait that may be
    /// its last ones: then they wait, too.
    fn receive(&mut self, buffer: &mut [u8], others: bool) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        self.last_byte = Instant::now();
        if others && peek(&self.file, &mut [0]) == Err(Errno::EAGAIN) {
            self.endpoint.refuse_others(OCCUPIED)?;
        }
        Ok(count)
    }

    /// Refuses a stranger among those that wait.
    ///
    /// # Errors
    /// [`Interruption::GaveWay`] where one of them begins to send.
    fn look_for_another(&self) -> io::Result<()> {
        match self.endpoint.arrival()? {
            Some(Arrival::Sender(file)) => {
                self.endpoint.put_back(file);
                Err(Interruption::GaveWay.into())
            }
            Some(Arrival::Stranger(file, stranger)) => {
                warn!("another sender was refused: {stranger}");
                self.endpoint.refuse(&file, &stranger.to_string());
                Ok(())
            }
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;
