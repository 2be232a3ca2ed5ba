//! A board with a deferred law, in the order of the chip.

use plumb_core::law_worker::{LawRequest, LawResponse};
use plumb_core::{Board, LawWorker, Outbox, TICK_US};
use plumb_protocol::Config;
use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{Command, Fault, FromBoard, Hello, Position, Telemetry, ToBoard};
use plumb_protocol::units::{Covariance, Micros};

use super::BUILD;
use super::bench::{BALL, TARGET, point};

/// A board, and a law worker that takes some ticks to respond.
pub(crate) struct DeferredBench {
    pub(crate) board: Board,
    pub(crate) law_worker: LawWorker,
    /// Ticks from a request to its response; `None` where no response comes.
    pub(crate) takes: Option<u32>,
    open: Option<(LawRequest, u32)>,
    /// Requests so far, with their ticks.
    pub(crate) requests: Vec<(u64, LawRequest)>,
    /// Responses so far.
    pub(crate) responses: Vec<LawResponse>,
    pub(crate) tick: u64,
    pub(crate) out: Outbox,
    sequence: u16,
    id: u16,
}

impl DeferredBench {
    /// Creates a board that seeks a target and has no position yet.
    pub(crate) fn seeking(config: Config, takes: Option<u32>) -> Self {
        let mut bench = Self {
            board: Board::new(BUILD),
            law_worker: LawWorker::new(),
            takes,
            open: None,
            requests: Vec::new(),
            responses: Vec::new(),
            tick: 0,
            out: Outbox::new(),
            sequence: 0,
            id: 0,
        };
        for command in [
            Command::Hello(Hello::OURS),
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
        self.id += 1;
        let frame = encode(&ToBoard { id: self.id, command }).unwrap();
        self.board.receive(self.now(), &frame, &mut self.out);
    }

    pub(crate) fn send_ball(&mut self, ball: [f64; 3]) {
        self.send_covariance(ball, None);
    }

    pub(crate) fn send_covariance(&mut self, ball: [f64; 3], covariance: Option<Covariance>) {
        self.sequence += 1;
        let (sequence, ball) = (self.sequence, Some(point(ball)));
        self.send(Command::Position(Position { sequence, age_us: 30_000, ball, covariance }));
    }

    /// Runs ticks in the chip's order: a response that has come, the plan, the next request.
    pub(crate) fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            if let Some((request, left)) = &mut self.open {
                *left -= 1;
                if *left == 0 {
                    let response = self.law_worker.respond(request);
                    self.board.on_law_response(&response);
                    self.responses.push(response);
                    self.open = None;
                }
            }
            self.board.plan(self.now(), &mut self.out);
            self.board.report(self.now(), &mut self.out);
            if let Some(request) = self.board.take_law_request() {
                self.requests.push((self.tick, request));
                self.open = self.takes.map(|ticks| (request, ticks));
            }
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
                positions.push(self.board.positions());
            }
        }
        positions
    }

    pub(crate) fn still(&self) -> bool {
        self.board.rates() == [0; 3]
    }

    /// Returns the ball of a rig with a constant Jacobian: 0.3 mm a step, pattern (12).
    pub(crate) fn ball(&self) -> [f64; 3] {
        let [a, b, c] = self.board.positions().map(|p| f64::from(p) / 16.0 * 0.3e-3);
        let moved = [c - a - b, b - a, -a - b - c];
        [0, 1, 2].map(|i| BALL[i] + moved[i])
    }

    /// Returns the board's telemetry of this moment.
    pub(crate) fn telemetry(&mut self) -> Telemetry {
        self.out.clear();
        self.send(Command::Status);
        let mut accumulator = Accumulator::new();
        let mut messages =
            self.out.bytes().iter().filter_map(|&b| accumulator.push::<FromBoard>(b));
        let telemetry = messages.find_map(|message| match message {
            Ok(FromBoard::Telemetry(telemetry)) => Some(telemetry),
            _ => None,
        });
        telemetry.unwrap()
    }

    pub(crate) fn has_reported(&mut self, fault: Fault) -> bool {
        let mut accumulator = Accumulator::new();
        let mut messages =
            self.out.bytes().iter().filter_map(|&b| accumulator.push::<FromBoard>(b));
        messages
            .any(|message| matches!(message, Ok(FromBoard::Fault(report)) if report.fault == fault))
    }
}
