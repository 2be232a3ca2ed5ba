//! Simulated link between a host and an emulated board: delays, lost and damaged frames, silences,
//! and restarts of the board. All faults follow from a seed, in the board's virtual time.
//!
//! Each direction is a [`Lane`], which transmits one frame after another. A frame starts when it is
//! sent or when the line is free, whichever is later. It occupies the line for the time of its
//! [`Line`], and arrives complete after the lane's latency. A frame ends at its zero byte.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::time::Duration;

use plumb_protocol::frame::MAX_FRAME;
use plumb_protocol::message::StartCause;
use plumb_protocol::units::Micros;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

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

/// Bits per byte on a UART: start bit, eight data bits, stop bit.
const UART_BITS: u64 = 10;

/// Counters of a lane's frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Traffic {
    /// Frames put onto the line; a doubled one counts twice.
    pub sent: u64,
    /// Frames of `sent` that were lost, at random or in a silence.
    pub lost: u64,
    /// Frames of `sent` that were damaged and not lost.
    pub damaged: u64,
    /// Frames that were doubled.
    pub doubled: u64,
    /// Frames that did not fit the sender's buffer, or were in it at a reboot.
    pub dropped: u64,
}

/// Frame on the line or waiting for it. Times are in nanoseconds of the board's clock, so that
/// rounding errors of frames do not add up.
struct Flight {
    /// Time at which it leaves the sender's buffer.
    sent_ns: u64,
    /// Time at which it is complete at the other end.
    arrives_ns: u64,
    /// Number of bytes in the sender's buffer.
    length: usize,
    /// Bytes that arrive; empty for a lost frame.
    bytes: Vec<u8>,
}

/// Sender's buffer and line of one direction.
pub(crate) struct Transmitter {
    lane: Lane,
    silences: Vec<Silence>,
    buffer: usize,
    random: ChaCha8Rng,
    /// Beginning of a frame whose end has not been sent yet.
    begun: Vec<u8>,
    flights: VecDeque<Flight>,
    line_free_ns: u64,
    traffic: Traffic,
}

impl Transmitter {
    /// Creates an idle transmitter with a buffer of `buffer` bytes. `seed` and `stream` select its
    /// random numbers.
    pub(crate) fn new(
        lane: Lane,
        silences: Vec<Silence>,
        buffer: usize,
        seed: u64,
        stream: u64,
    ) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        Self {
            lane,
            silences,
            buffer,
            random,
            begun: Vec::new(),
            flights: VecDeque::new(),
            line_free_ns: 0,
            traffic: Traffic::default(),
        }
    }

    /// Sends `bytes`, which may be pieces of frames. A frame starts when its zero byte is given.
    /// Bytes without a zero are sent in pieces of [`MAX_FRAME`].
    pub(crate) fn send(&mut self, now: Micros, bytes: &[u8]) {
        for &byte in bytes {
            self.begun.push(byte);
            if byte == 0 || self.begun.len() == MAX_FRAME {
                let frame = std::mem::take(&mut self.begun);
                let doubled = self.chance(self.lane.doubled);
                self.traffic.doubled += u64::from(doubled);
                if doubled {
                    self.transmit(now, frame.clone());
                }
                self.transmit(now, frame);
            }
        }
    }

    /// Returns the next frame, in order, that has arrived by `now`.
    pub(crate) fn receive(&mut self, now: Micros) -> Option<Vec<u8>> {
        while self.flights.front().is_some_and(|flight| flight.arrives_ns <= nanoseconds(now)) {
            let flight = self.flights.pop_front()?;
            if !flight.bytes.is_empty() {
                return Some(flight.bytes);
            }
        }
        None
    }

    /// Drops all frames that have not left the sender by `now`, after a restart of the sender.
    pub(crate) fn restart(&mut self, now: Micros) {
        let before = self.flights.len();
        self.flights.retain(|flight| flight.sent_ns <= nanoseconds(now));
        self.traffic.dropped += (before - self.flights.len()) as u64;
        self.begun.clear();
        self.line_free_ns = self.line_free_ns.min(nanoseconds(now));
    }

    /// Returns the counters.
    pub(crate) fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// Puts a frame onto the line, or drops it if the buffer is full, like the firmware's `Outbox`.
    fn transmit(&mut self, now: Micros, frame: Vec<u8>) {
        let (now_ns, length) = (nanoseconds(now), frame.len());
        let waiting = self.flights.iter().filter(|flight| flight.sent_ns > now_ns);
        if waiting.map(|flight| flight.length).sum::<usize>() + length > self.buffer {
            self.traffic.dropped += 1;
            return;
        }
        let start_ns = self.line_free_ns.max(now_ns);
        let sent_ns = start_ns + self.line_ns(length);
        let arrives_ns = sent_ns + self.lane.latency.as_nanos() as u64;
        self.line_free_ns = sent_ns;
        let bytes = self.disturb(frame, self.is_silent(start_ns, arrives_ns));
        self.flights.push_back(Flight { sent_ns, arrives_ns, length, bytes });
    }

    /// Returns the bytes of `frame` that arrive.
    fn disturb(&mut self, mut frame: Vec<u8>, silent: bool) -> Vec<u8> {
        self.traffic.sent += 1;
        // Draws both for every frame, so that a silence does not change later faults.
        let lost = self.chance(self.lane.lost);
        let damaged = self.chance(self.lane.damaged);
        if lost || silent {
            self.traffic.lost += 1;
            frame.clear();
        } else if damaged {
            self.traffic.damaged += 1;
            self.damage(&mut frame);
        }
        frame
    }

    /// Damages a frame of at least one byte, at one random byte.
    fn damage(&mut self, frame: &mut Vec<u8>) {
        let place = self.random.random_range(0..frame.len());
        match self.random.random_range(0..4) {
            0 => frame[place] ^= 1 << self.random.random_range(0..8),
            1 => drop(frame.remove(place)),
            2 => frame.insert(place, frame[place]),
            _ => frame.insert(place, self.random.random()),
        }
    }

    /// Returns `true` with probability `p`. Draws no random number if `p` is 0.
    fn chance(&mut self, p: f64) -> bool {
        p > 0.0 && self.random.random::<f64>() < p
    }

    /// Returns whether the link is silent at any moment from `start_ns` to `end_ns`.
    fn is_silent(&self, start_ns: u64, end_ns: u64) -> bool {
        self.silences.iter().any(|silence| {
            nanoseconds(silence.from) <= end_ns && start_ns < nanoseconds(silence.to)
        })
    }

    /// Returns the time for which `length` bytes occupy the line, nanoseconds.
    fn line_ns(&self, length: usize) -> u64 {
        match self.lane.line {
            Line::Instant => 0,
            Line::Baud(rate) => length as u64 * UART_BITS * 1_000_000_000 / u64::from(rate.max(1)),
            Line::Frame(time) => time.as_nanos() as u64,
        }
    }
}

/// Converts `time` to nanoseconds.
fn nanoseconds(time: Micros) -> u64 {
    time.0.saturating_mul(1000)
}
