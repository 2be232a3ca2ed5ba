//! A board as a host sees it: bytes in, bytes out, a tick every 200 µs.

use plumb_core::{BuildLimits, TICK_US, Tick};
use plumb_emulator::{Harness, LawDelay};
use plumb_protocol::message::*;
use plumb_protocol::units::{Micros, Point};
use plumb_protocol::{Config, Wiring};

use super::{BUILD, config, wiring};

/// A board with its clock and its messages.
pub(crate) struct Bench {
    pub(crate) harness: Harness,
    pub(crate) now: u64,
    pub(crate) received: Vec<FromBoard>,
    pub(crate) sequence: u16,
    /// Id of the last request.
    pub(crate) id: u16,
    /// Last outputs besides the pulses.
    pub(crate) outputs: Tick,
}

/// Id of the wiring: none that a test uses.
const WIRE_ID: u16 = 60_000;
pub(crate) const TARGET: [f64; 3] = [0.4, 0.4, 0.15];
pub(crate) const BALL: [f64; 3] = [0.54, 0.22, 0.459];

pub(crate) fn point(metres: [f64; 3]) -> Point {
    Point::from_metres(metres).unwrap()
}

impl Bench {
    pub(crate) fn new(build: BuildLimits) -> Self {
        Self {
            harness: Harness::new(build, LawDelay::SameTick),
            now: 0,
            received: Vec::new(),
            sequence: 0,
            id: 0,
            outputs: Tick::default(),
        }
    }

    pub(crate) fn greeted(build: BuildLimits) -> Self {
        let mut bench = Self::new(build);
        bench.greet();
        bench
    }

    /// Greets the board and sends it a wiring.
    pub(crate) fn greet(&mut self) {
        assert_eq!(self.send(Command::Hello(Hello::OURS)), Ok(()));
        assert_eq!(self.send_as(WIRE_ID, Command::Wire(wiring())), Ok(()));
    }

    pub(crate) fn configured(config: Config) -> Self {
        Self::wired(wiring(), config)
    }

    pub(crate) fn wired(wiring: Wiring, config: Config) -> Self {
        let mut bench = Self::greeted(BUILD);
        assert_eq!(bench.send_as(WIRE_ID, Command::Wire(wiring)), Ok(()));
        assert_eq!(bench.send(Command::Configure(config)), Ok(()));
        bench
    }

    /// Creates a board that seeks a target and gets positions.
    pub(crate) fn seeking() -> Self {
        let mut bench = Self::configured(config());
        bench.send_ball(BALL);
        assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
        bench.run_with_ball(5, BALL);
        assert_eq!(bench.harness.board.state(), State::Seeking);
        bench
    }

    pub(crate) fn collect(&mut self) {
        self.received.extend(self.harness.take_messages().into_iter().map(Result::unwrap));
    }

    /// Sends a new command as bytes. Returns its answer.
    pub(crate) fn send(&mut self, command: Command) -> Result<(), Refusal> {
        self.id += 1;
        self.send_as(self.id, command)
    }

    /// Sends a command with this id. Returns its answer.
    pub(crate) fn send_as(&mut self, id: u16, command: Command) -> Result<(), Refusal> {
        self.harness.send_as(Micros(self.now), id, command);
        self.collect();
        match self.received.last() {
            Some(FromBoard::Answer(Answer { id: answered, refusal: Some(refusal), .. }))
                if *answered == id =>
            {
                Err(*refusal)
            }
            _ => Ok(()),
        }
    }

    pub(crate) fn send_position(
        &mut self,
        ball: Option<[f64; 3]>,
        age_us: u32,
    ) -> Result<(), Refusal> {
        self.sequence = self.sequence.wrapping_add(1);
        let sequence = self.sequence;
        self.send(Command::Position(Position {
            sequence,
            age_us,
            ball: ball.map(point),
            covariance: None,
        }))
    }

    pub(crate) fn send_ball(&mut self, ball: [f64; 3]) {
        let _ = self.send_position(Some(ball), 30_000);
    }

    pub(crate) fn tick(&mut self) -> Tick {
        let outputs = self.harness.tick(Micros(self.now));
        self.outputs = outputs.unwrap_or(self.outputs);
        self.now += u64::from(TICK_US);
        self.collect();
        self.outputs
    }

    pub(crate) fn run_ms(&mut self, ms: u64) {
        for _ in 0..ms * 1000 / u64::from(TICK_US) {
            self.tick();
        }
    }

    pub(crate) fn run_with_ball(&mut self, frames: u32, ball: [f64; 3]) {
        for _ in 0..frames {
            self.send_ball(ball);
            self.run_ms(33);
        }
    }

    pub(crate) fn moving(&self) -> bool {
        self.harness.board.rates() != [0; 3]
    }

    /// Takes the messages received so far. Returns the answers among them.
    pub(crate) fn answers(&mut self) -> Vec<Result<(), Refusal>> {
        self.collect();
        let answer = |m| match m {
            FromBoard::Answer(Answer { refusal, .. }) => Some(refusal.map_or(Ok(()), Err)),
            _ => None,
        };
        self.received.drain(..).filter_map(answer).collect()
    }

    pub(crate) fn faults(&self) -> Vec<Fault> {
        let fault = |m: &FromBoard| match m {
            FromBoard::Fault(report) => Some(report.fault),
            _ => None,
        };
        self.received.iter().filter_map(fault).collect()
    }

    /// Checks that the board is in this fault, has reported it once, comes to rest within its ramp
    /// and stays there. Then clears the fault.
    pub(crate) fn assert_stopped_by(&mut self, fault: Fault) {
        assert_eq!(self.harness.board.state(), State::Fault(fault));
        assert_eq!(self.faults(), [fault]);
        self.run_ms(210);
        let rest = self.harness.board.positions();
        self.run_with_ball(30, BALL);
        assert!(!self.moving() && self.harness.board.positions() == rest);
        assert_eq!(self.send(Command::Target(point(TARGET))), Err(Refusal::Faulted(fault)));
        assert_eq!(self.send(Command::ClearFault), Ok(()));
        assert_eq!(self.harness.board.state(), State::Ready);
    }
}
