//! Connection of a sender, with deadlines.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use tracing::warn;

use super::endpoint::Endpoint;

/// Longest time without a byte within a frame.
pub(super) const STALL: Duration = Duration::from_secs(2);

/// Longest wait of one call into the operating system, ms: the reaction time to a closed stream.
const POLL_MS: u16 = 100;

/// Connection of a sender. A read ends when the stream is closed ([`ErrorKind::Other`]), and when
/// the sender stops within a frame ([`ErrorKind::TimedOut`]). Meanwhile, it refuses other senders.
pub struct Connection<'a> {
    file: File,
    endpoint: &'a Endpoint,
    is_closed: &'a dyn Fn() -> bool,
    /// Whether the sender is within a frame.
    pub(super) is_in_frame: bool,
}

impl Read for Connection<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let begin = Instant::now();
        loop {
            if (self.is_closed)() {
                return Err(io::Error::other("the stream is closed"));
            }
            let readable = wait(&[Some(self.file.as_fd()), self.endpoint.listener()])?;
            if readable[1] {
                self.refuse_another()?;
            }
            if readable[0] {
                return self.file.read(buffer);
            }
            if self.is_in_frame && begin.elapsed() >= STALL {
                return Err(ErrorKind::TimedOut.into());
            }
        }
    }
}

impl<'a> Connection<'a> {
    /// Returns the connection of a sender that `endpoint` has accepted. `is_closed` returns whether
    /// the stream is closed.
    pub fn new(file: File, endpoint: &'a Endpoint, is_closed: &'a dyn Fn() -> bool) -> Self {
        Self { file, endpoint, is_closed, is_in_frame: false }
    }

    /// Refuses a sender that connects while this one is connected.
    fn refuse_another(&self) -> io::Result<()> {
        if let Some(other) = self.endpoint.accept()? {
            let reason = "another sender is connected; Plumb listens to one";
            warn!("a second sender was refused: {reason}");
            self.endpoint.refuse(&other, reason);
        }
        Ok(())
    }
}

/// Waits until one of the handles is readable or has ended, for [`POLL_MS`] at most. Returns which
/// are.
pub(super) fn wait(handles: &[Option<std::os::fd::BorrowedFd<'_>>; 2]) -> io::Result<[bool; 2]> {
    let mut present: Vec<PollFd<'_>> =
        handles.iter().flatten().map(|&fd| PollFd::new(fd, PollFlags::POLLIN)).collect();
    match poll(&mut present, PollTimeout::from(POLL_MS)) {
        Ok(_) | Err(nix::errno::Errno::EINTR) => {}
        Err(error) => return Err(error.into()),
    }
    let mut results = present.iter().map(|fd| fd.any().unwrap_or(false));
    Ok(handles.map(|handle| handle.is_some() && results.next().unwrap_or(false)))
}
