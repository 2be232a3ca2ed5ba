//! Gate between the network and the DDS library, which allocates what packets claim.
//!
//! The library (RustDDS 0.15) opens its own sockets. The gate connects each of them to one of its
//! own, from which alone they receive from then on (udp(7), connect(2)). It takes over their ports,
//! and hands on the packets that its [`Guard`] admits:
//!
//! ```text
//! network -> port of the library, now the gate's -> Guard -> outlet -> socket of the library
//! ```

mod guard;
mod packet;
mod sockets;
#[cfg(test)]
mod tests;

use std::collections::HashSet;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::thread;
use std::time::Instant;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use plumb_frame::source::BoxedError;

pub(crate) use self::guard::Guard;
use self::guard::Refusal;
use self::sockets::{Fence, Outlets};

/// Most bytes of a packet of UDP.
const MAX_PACKET: usize = 1 << 16;

/// Most packets of a port in a row.
const MAX_IN_TURN: usize = 64;

/// The gate of a participant. It is closed when dropped.
pub(crate) struct Gate {
    /// Its end ends the thread.
    _stop: UnixStream,
}

impl Gate {
    /// Calls `build`, which opens the sockets of the library in a `domain`, and puts a gate before
    /// them. With a loopback `interface` it admits this computer's packets only.
    ///
    /// # Errors
    /// Where `build` fails, or the operating system refuses.
    pub(crate) fn around<T>(
        domain: u16,
        interface: Option<IpAddr>,
        guard: Guard,
        build: impl FnOnce() -> Result<T, BoxedError>,
    ) -> Result<(T, Self), BoxedError> {
        let fence = Fence::begin(domain, Outlets::open(interface)?)?;
        let (built, fenced) = (build(), fence.end());
        let (built, (inlets, outlets)) = (built?, fenced?);
        let (stop, stopped) = UnixStream::pair()?;
        let is_local = interface.is_some_and(|it| it.is_loopback());
        let refused = HashSet::new();
        let relay = Relay { inlets, outlets, guard, is_local, refused };
        thread::Builder::new().name("ros2 gate".to_owned()).spawn(move || relay.run(&stopped))?;
        Ok((built, Self { _stop: stop }))
    }
}

/// Thread that hands packets on.
struct Relay {
    inlets: Vec<UdpSocket>,
    outlets: Outlets,
    guard: Guard,
    /// Whether only this computer's packets are admitted.
    is_local: bool,
    /// Reasons of refusals that were told.
    refused: HashSet<Refusal>,
}

impl Relay {
    /// Hands packets on until the other end of `stopped` is closed.
    fn run(mut self, stopped: &UnixStream) {
        let mut packet = vec![0; MAX_PACKET];
        loop {
            let sockets = self.inlets.iter().map(AsFd::as_fd).chain([stopped.as_fd()]);
            let mut ready: Vec<_> = sockets.map(|it| PollFd::new(it, PollFlags::POLLIN)).collect();
            // An interruption is a wake-up without packets.
            let _interrupted = poll(&mut ready, PollTimeout::NONE);
            let mut is_ready = ready.iter().map(|it| it.any().unwrap_or_default());
            let ready: Vec<_> = is_ready.by_ref().take(self.inlets.len()).collect();
            if is_ready.any(|it| it) {
                return;
            }
            for (inlet, _) in ready.into_iter().enumerate().filter(|(_, is_ready)| *is_ready) {
                for _ in 0..MAX_IN_TURN {
                    let Ok((length, from)) = self.inlets[inlet].recv_from(&mut packet) else {
                        break;
                    };
                    self.hand_on(&packet[..length], from);
                }
            }
        }
    }

    /// Hands a packet on if it may pass.
    fn hand_on(&mut self, packet: &[u8], from: SocketAddr) {
        if self.is_local && !from.ip().is_loopback() {
            return;
        }
        match self.guard.admit(packet, Instant::now()) {
            Ok(()) => self.outlets.send(packet, from),
            // The usual ones: what comes before an announcement, twice, or from another protocol.
            Err(Refusal::Unannounced | Refusal::Damaged | Refusal::Repeated) => {}
            Err(refusal) => {
                if self.refused.insert(refusal) {
                    tracing::warn!("ROS 2 does not take {refusal}");
                }
            }
        }
    }
}
