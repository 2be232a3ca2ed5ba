//! Simulated link between a host and an emulated board: delays, lost and damaged frames, silences,
//! and restarts of the board. All faults follow from a seed, in the board's virtual time.
//!
//! Each direction is a [`Lane`], which transmits one frame after another. A frame starts when it is
//! sent or when the line is free, whichever is later. It occupies the line for the time of its
//! [`Line`], and arrives complete after the lane's latency. A frame ends at its zero byte.

mod lane;
#[cfg(test)]
mod tests;
mod transmitter;

use plumb_protocol::message::StartCause;
use plumb_protocol::units::Micros;

pub use lane::{Lane, Line, Silence};
pub use transmitter::Traffic;
pub(crate) use transmitter::Transmitter;

/// Size of the buffer towards the board, bytes: the output buffer of a serial port in Linux.
pub const TO_BOARD_BUFFER: usize = 4096;

/// Size of the buffer towards the host, bytes: the firmware's `Outbox`.
pub const TO_HOST_BUFFER: usize = 1024;

/// Restart of the board.
///
/// The board runs again in the same tick: add a [`Silence`] for the duration of a start. Its clock
/// continues, its motor positions start at 0, and unsent bytes are lost. The simulated rig keeps
/// its position, as if the motors held it without current.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reboot {
    /// Time on the board's clock.
    pub at: Micros,
    /// Cause that the board reports.
    pub cause: StartCause,
}

/// Settings of a link. The default is an ideal link: no delay, no faults, no reboots.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Wire {
    /// Lane from the host to the board.
    pub to_board: Lane,
    /// Lane from the board to the host.
    pub to_host: Lane,
    /// Interruptions of both directions.
    pub silences: Vec<Silence>,
    /// Restarts of the board, in any order.
    pub reboots: Vec<Reboot>,
    /// Seed of all lost, damaged and doubled frames.
    pub seed: u64,
}

impl Wire {
    /// Creates a link with the same lane in both directions.
    pub fn symmetric(lane: Lane, seed: u64) -> Self {
        Self { to_board: lane.clone(), to_host: lane, seed, ..Self::default() }
    }
}

/// State of a link.
pub(crate) struct Link {
    pub(crate) to_board: Transmitter,
    pub(crate) to_host: Transmitter,
    /// Future reboots, the next one last.
    reboots: Vec<Reboot>,
}

impl Link {
    /// Creates an idle link.
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
