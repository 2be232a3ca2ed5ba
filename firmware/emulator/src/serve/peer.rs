//! The program at the other end of a socket.

use std::fs;
use std::io;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::time::Duration;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::socket::{getsockopt, sockopt::PeerCredentials};

/// Socket to another program on this computer.
#[derive(Debug)]
pub(super) struct Peer {
    pub(super) stream: UnixStream,
    /// Process id; 0 where it is unknown.
    process: i32,
}

impl Peer {
    /// Returns the program at the other end of `stream`.
    pub(super) fn of(stream: UnixStream) -> Self {
        let process = getsockopt(&stream, PeerCredentials).map_or(0, |peer| peer.pid());
        Self { stream, process }
    }

    /// Waits for `limit` at most until bytes from the program are there, or it has gone. Returns
    /// whether one of both is so.
    pub(super) fn wait(&self, limit: Duration) -> io::Result<bool> {
        let timeout = PollTimeout::try_from(limit).unwrap_or(PollTimeout::MAX);
        let mut polled = [PollFd::new(self.stream.as_fd(), PollFlags::POLLIN)];
        match poll(&mut polled, timeout) {
            // By a signal.
            Err(Errno::EINTR) => Ok(false),
            ready => Ok(ready? > 0),
        }
    }

    /// Returns whether the program is stopped, as by Ctrl-Z. One that only waits for the processor
    /// is not.
    pub(super) fn is_stopped(&self) -> bool {
        // The name of the program, in brackets, may contain anything.
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.process)).unwrap_or_default();
        let state = stat.rsplit_once(") ").and_then(|(_, fields)| fields.chars().next());
        matches!(state, Some('T' | 't'))
    }
}
