//! A link between a host and an emulated board that takes time, loses and damages frames, falls
//! silent and sees the board restart: everything from a seed, in the board's virtual time.
//!
//! Each direction is a [`Lane`]. It transmits one frame after the other: a frame starts when it is
//! sent or when the line is free, whichever is later, occupies the line for the time that its
//! [`Line`] says, and is complete at the other end after the lane's latency. A frame ends at its
//! zero byte and is handed over whole.

#[cfg(test)]
mod tests;
mod transmitter;

use std::time::Duration;

use plumb_protocol::message::StartCause;
use plumb_protocol::units::Micros;

pub use transmitter::Traffic;
pub(crate) use transmitter::Transmitter;

/// Bytes that wait for the line towards the board: the output buffer of a serial port in Linux.
pub const TO_BOARD_BUFFER: usize = 4096;

/// Bytes that wait for the line towards the host: the firmware's `Outbox`.
pub const TO_HOST_BUFFER: usize = 1024;

/// How long a frame occupies the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Line {
    /// No time.
    #[default]
    Instant,
    /// A UART of this rate, bit/s: ten bits a byte. A rate of 0 counts as 1.
    Baud(u32),
    /// The same time for every frame, however long: USB, which sends packets at fixed intervals.
    Frame(Duration),
}

/// One direction of a link. The default is an ideal one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lane {
    /// How long a frame occupies the line.
    pub line: Line,
    /// From the end of a frame on the line to its arrival.
    pub latency: Duration,
    /// Probability that a frame is lost, 0 to 1. A lost frame occupies the line all the same.
    pub lost: f64,
    /// Probability that a frame is damaged, 0 to 1: at a random place a bit is flipped, a byte is
    /// lost, a byte comes twice, or a random byte is inserted, with equal probability. The place
    /// may be the closing zero; the frame then runs into the next one.
    pub damaged: f64,
    /// Probability that a frame comes twice, 0 to 1. The second one follows on the line and may be
    /// lost or damaged by itself.
    pub doubled: f64,
}

impl Lane {
    /// A lane with this line and without faults.
    pub fn on(line: Line) -> Self {
        Self { line, ..Self::default() }
    }
}

/// A span of the board's clock in which the link is interrupted. A frame that is on its way at any
/// moment of it is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Silence {
    /// Its begin.
    pub from: Micros,
    /// Its end, which is no longer part of it.
    pub to: Micros,
}

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
