//! Settings of one direction of a link.

use std::time::Duration;

use plumb_protocol::units::Micros;

/// Time that a frame occupies the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Line {
    /// No time.
    #[default]
    Instant,
    /// A UART with this rate, bit/s: ten bits per byte. A rate of 0 counts as 1.
    Baud(u32),
    /// The same time for a frame of any length: USB, which sends packets at fixed intervals.
    Frame(Duration),
}

/// Settings of one direction of a link. The default is ideal: no delay and no faults.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lane {
    /// Time that a frame occupies the line.
    pub line: Line,
    /// Time from the end of a frame on the line to its arrival.
    pub latency: Duration,
    /// Probability that a frame is lost, 0 to 1. A lost frame also occupies the line.
    pub lost: f64,
    /// Probability that a frame is damaged, 0 to 1. At a random byte, one of four faults happens
    /// with equal probability: a flipped bit, a lost byte, a doubled byte, an inserted random byte.
    /// The byte may be the closing zero; the frame is then joined with the next one.
    pub damaged: f64,
    /// Probability that a frame is doubled, 0 to 1. The second copy follows on the line; it is lost
    /// or damaged independently.
    pub doubled: f64,
}

impl Lane {
    /// Creates a lane with this line, no latency and no faults.
    pub fn on(line: Line) -> Self {
        Self { line, ..Self::default() }
    }
}

/// Interval of the board's clock in which the link is interrupted. A frame that is on the link at
/// any moment of it is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Silence {
    /// Start.
    pub from: Micros,
    /// End, exclusive.
    pub to: Micros,
}
