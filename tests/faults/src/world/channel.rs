//! One direction of the link, with its faults.

use std::collections::VecDeque;

use plumb_protocol::frame::encode;
use plumb_protocol::message::{Command, Hello, ToBoard, VERSION};
use plumb_protocol::units::Micros;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::kind::Kind;
use crate::plan::{Fault, Plan};

/// Time of a frame on a healthy link, µs: one frame of USB.
const LATENCY_US: u64 = 1000;
/// Largest delay of a frame that a later one overtakes, µs.
const OVERTAKEN_US: u64 = 50_000;
/// Time between the Hellos of another program, µs.
const HELLO_US: u64 = 100_000;

/// A frame on its way.
struct Flight {
    arrives: u64,
    bytes: Vec<u8>,
}

/// One direction of the link.
pub(super) struct Channel {
    faults: Vec<Fault>,
    random: ChaCha8Rng,
    is_to_board: bool,
    /// Beginning of a frame whose end has not been sent.
    begun: Vec<u8>,
    /// In the order of their arrival.
    flights: VecDeque<Flight>,
    /// Number of Hellos that another program has sent.
    hellos: u64,
}

impl Channel {
    /// Returns a direction of the link of `plan`: 0 to the board, 1 to the host.
    pub(super) fn new(plan: &Plan, direction: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(plan.seed);
        random.set_stream(1 + direction);
        Self {
            faults: plan.faults.clone(),
            random,
            is_to_board: direction == 0,
            begun: Vec::new(),
            flights: VecDeque::new(),
            hellos: 0,
        }
    }

    /// Sends `bytes`, which may be pieces of frames.
    pub(super) fn send(&mut self, now: Micros, bytes: &[u8]) {
        for &byte in bytes {
            self.begun.push(byte);
            if byte == 0 {
                let frame = std::mem::take(&mut self.begun);
                self.transmit(now, frame);
            }
        }
    }

    /// Returns the bytes that have arrived by `now`; call every tick.
    pub(super) fn receive(&mut self, now: Micros) -> Vec<Vec<u8>> {
        self.add_other_senders(now);
        let mut arrived = Vec::new();
        while let Some(flight) = self.flights.pop_front_if(|flight| flight.arrives <= now.0) {
            arrived.push(flight.bytes);
        }
        arrived
    }

    /// Puts a frame onto the link.
    fn transmit(&mut self, now: Micros, mut frame: Vec<u8>) {
        let mut arrives = now.0 + LATENCY_US;
        let acting: Vec<Fault> =
            self.faults.iter().copied().filter(|fault| fault.acts(now)).collect();
        for fault in acting {
            match fault.kind {
                Kind::DelayedFrames => arrives += fault.between(10_000.0, 600_000.0) as u64,
                Kind::Unplugged | Kind::Reset | Kind::Crash => return,
                _ if !self.is_hit(&fault) => {}
                Kind::LostFrames => return,
                Kind::BitFlips => {
                    let place = self.random.random_range(0..frame.len());
                    frame[place] ^= 1 << self.random.random_range(0..8);
                }
                Kind::TornFrames => frame.truncate(self.random.random_range(0..frame.len())),
                Kind::DoubledFrames => self.insert(arrives, frame.clone()),
                Kind::ReorderedFrames => arrives += self.random.random_range(0..OVERTAKEN_US),
                _ => {}
            }
        }
        self.insert(arrives, frame);
    }

    /// Draws whether a fault of single frames hits this one.
    fn is_hit(&mut self, fault: &Fault) -> bool {
        self.random.random::<f64>() < fault.between(0.05, 1.0)
    }

    /// Adds what others than host and board put onto the link in the tick before `now`.
    fn add_other_senders(&mut self, now: Micros) {
        for index in 0..self.faults.len() {
            let fault = self.faults[index];
            if !fault.acts(now) {
                continue;
            }
            match fault.kind {
                Kind::Babble if self.random.random_range(0..10) == 0 => {
                    let length = self.random.random_range(1..20);
                    let noise = (0..length).map(|_| self.random.random()).collect();
                    self.insert(now.0, noise);
                }
                Kind::WrongVersion
                    if self.is_to_board && now.since(fault.from) >= self.hellos * HELLO_US =>
                {
                    self.hellos += 1;
                    self.insert(now.0, other_hello());
                }
                _ => {}
            }
        }
    }

    fn insert(&mut self, arrives: u64, bytes: Vec<u8>) {
        let place = self.flights.partition_point(|flight| flight.arrives <= arrives);
        self.flights.insert(place, Flight { arrives, bytes });
    }
}

/// Returns the Hello of a program of the next version.
fn other_hello() -> Vec<u8> {
    let hello = Hello { version: VERSION + 1, ..Hello::OURS };
    let message = ToBoard { id: 1, command: Command::Hello(hello) };
    encode(&message).expect("a Hello fits a frame").to_vec()
}
