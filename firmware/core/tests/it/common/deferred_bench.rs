//! A board with a deferred law, in the order of the chip.

use plumb_core::TICK_US;
use plumb_core::law_worker::{LawRequest, LawResponse};
use plumb_emulator::{Harness, LawDelay};
use plumb_protocol::Config;
use plumb_protocol::message::{Command, Fault, FromBoard, Hello, Position, Telemetry};
use plumb_protocol::units::{Covariance, Micros};

use super::bench::{BALL, TARGET, point};
use super::{BUILD, wiring};

/// A board, and a law worker that takes some ticks to respond.
pub(crate) struct DeferredBench {
    pub(crate) harness: Harness,
    /// Requests so far, with their ticks.
    pub(crate) requests: Vec<(u64, LawRequest)>,
    /// Responses so far.
    pub(crate) responses: Vec<LawResponse>,
    pub(crate) tick: u64,
    sequence: u16,
}

impl DeferredBench {
    /// Creates a board that seeks a target and has no position yet.
    pub(crate) fn seeking(config: Config, delay: LawDelay) -> Self {
        let mut bench = Self {
            harness: Harness::new(BUILD, delay),
            requests: Vec::new(),
            responses: Vec::new(),
            tick: 0,
            sequence: 0,
        };
        for command in [
            Command::Hello(Hello::OURS),
            Command::Wire(wiring()),
            Command::Configure(config),
            Command::Target(point(TARGET)),
        ] {
            bench.send(command);
        }
        bench
    }

    pub(crate) fn now(&self) -> Micros {
        Micros(self.tick * u64::from(TICK_US))
    }

    pub(crate) fn send(&mut self, command: Command) {
        self.harness.send(self.now(), command);
    }

    pub(crate) fn send_ball(&mut self, ball: [f64; 3]) {
        self.send_covariance(ball, None);
    }

    pub(crate) fn send_covariance(&mut self, ball: [f64; 3], covariance: Option<Covariance>) {
        self.sequence += 1;
        let (sequence, ball) = (self.sequence, Some(point(ball)));
        self.send(Command::Position(Position { sequence, age_us: 30_000, ball, covariance }));
    }

    /// Runs ticks. Notes the requests and responses of the law worker.
    pub(crate) fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.harness.tick(self.now());
            self.responses.extend(self.harness.law_response());
            let request = self.harness.law_request();
            self.requests.extend(request.map(|request| (self.tick, *request)));
            self.tick += 1;
        }
    }

    /// Sends a position each 33 ms, of a ball that comes nearer. Returns the motor positions
    /// of each millisecond.
    pub(crate) fn run_with_ball(&mut self, pictures: u32) -> Vec<[i32; 3]> {
        let mut positions = Vec::new();
        for k in 0..pictures {
            let part = f64::from(k.min(40)) / 50.0;
            self.send_ball([0, 1, 2].map(|i| BALL[i] + part * (TARGET[i] - BALL[i])));
            for _ in 0..33 {
                self.run(5);
                positions.push(self.harness.board.positions());
            }
        }
        positions
    }

    pub(crate) fn still(&self) -> bool {
        self.harness.board.rates() == [0; 3]
    }

    /// Returns the ball of a rig with a constant Jacobian: 0.3 mm a step, pattern (12).
    pub(crate) fn ball(&self) -> [f64; 3] {
        let [a, b, c] = self.harness.board.positions().map(|p| f64::from(p) / 16.0 * 0.3e-3);
        let moved = [c - a - b, b - a, -a - b - c];
        [0, 1, 2].map(|i| BALL[i] + moved[i])
    }

    /// Returns the board's telemetry of this moment.
    pub(crate) fn telemetry(&mut self) -> Telemetry {
        self.harness.outbox.clear();
        self.send(Command::Status);
        let mut messages = self.harness.take_messages().into_iter();
        let telemetry = messages.find_map(|message| match message {
            Ok(FromBoard::Telemetry(telemetry)) => Some(telemetry),
            _ => None,
        });
        telemetry.unwrap()
    }

    pub(crate) fn has_reported(&mut self, fault: Fault) -> bool {
        self.harness
            .take_messages()
            .iter()
            .any(|message| matches!(message, Ok(FromBoard::Fault(report)) if report.fault == fault))
    }
}
