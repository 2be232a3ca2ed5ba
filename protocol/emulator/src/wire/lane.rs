//! Settings of one direction of a link.

use std::time::Duration;

use plumb_protocol::units::Micros;

/// Time that a frame occupies the line.
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
    /// Time that a frame occupies the line.
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
    /// Beginning.
    pub from: Micros,
    /// End, exclusive.
    pub to: Micros,
}
