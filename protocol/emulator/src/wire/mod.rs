//! A link between a host and an emulated board that takes time, loses and damages frames, falls
//! silent and sees the board restart: everything from a seed, in the board's virtual time.
//!
//! Each direction is a [`Lane`]. It transmits one frame after the other: a frame starts when it is
//! sent or when the line is free, whichever is later, occupies the line for the time that its
//! [`Line`] says, and is complete at the other end after the lane's latency. A frame ends at its
//! zero byte and is handed over whole.

mod lane;
#[cfg(test)]
mod tests;
mod transmitter;

use plumb_protocol::message::StartCause;
use plumb_protocol::units::Micros;

pub use lane::{Lane, Line, Silence};
pub use transmitter::Traffic;
pub(crate) use transmitter::Transmitter;

/// Bytes that wait for the line towards the board: the output buffer of a serial port in Linux.
pub const TO_BOARD_BUFFER: usize = 4096;

/// Bytes that wait for the line towards the host: the firmware's `Outbox`.
pub const TO_HOST_BUFFER: usize = 1024;

/// A restart of the board.
///
/// The board is up again in the same tick: add a [`Silence`] for the time that a start takes. Its
/// clock goes on, its motor positions begin at 0, and everything that waits to be sent is lost. The
/// simulated rig stays where it is, as if the motors held it without current.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reboot {
    /// The moment on the board's clock.
    pub at: Micros,
    /// The cause that the board reports.
    pub cause: StartCause,
}

/// The settings of a link. The default is an ideal link: no delay, no faults, no reboots.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Wire {
    /// From the host to the board.
    pub to_board: Lane,
    /// From the board to the host.
    pub to_host: Lane,
    /// Interruptions of both directions.
    pub silences: Vec<Silence>,
    /// Restarts of the board, in any order.
    pub reboots: Vec<Reboot>,
    /// Seed of all losses, damages and doublings.
    pub seed: u64,
}

impl Wire {
    /// A link that is the same in both directions.
    pub fn symmetric(lane: Lane, seed: u64) -> Self {
        Self { to_board: lane.clone(), to_host: lane, seed, ..Self::default() }
    }
}

/// A link at work.
pub(crate) struct Link {
    pub(crate) to_board: Transmitter,
    pub(crate) to_host: Transmitter,
    /// Reboots to come, the next one last.
    reboots: Vec<Reboot>,
}

impl Link {
    pub(crate) fn new(wire: Wire) -> Self {
        let Wire { to_board, to_host, silences, mut reboots, seed } = wire;
        reboots.sort_by_key(|reboot| std::cmp::Reverse(reboot.at));
        // Two streams of one seed are independent.
        Self {
            to_board: Transmitter::new(to_board, silences.clone(), TO_BOARD_BUFFER, seed, 0),
            to_host: Transmitter::new(to_host, silences, TO_HOST_BUFFER, seed, 1),
            reboots,
        }
    }

    /// Returns the cause of a reboot that is due at `now` and has not happened yet.
    pub(crate) fn reboot(&mut self, now: Micros) -> Option<StartCause> {
        self.reboots.pop_if(|reboot| reboot.at <= now).map(|reboot| reboot.cause)
    }
}
