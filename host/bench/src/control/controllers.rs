//! Contenders as drivers: the board's own code, bytes and all, and plans made beforehand.

use nalgebra::Point3;
use plumb_core::{Board, LawWorker, Outbox};
use plumb_emulator::EMULATED;
use plumb_protocol::Config;
use plumb_protocol::frame;
use plumb_protocol::message::{Command, Fault, Hello, Position, State, ToBoard};
use plumb_protocol::units::{Micros, Point, Steps16};

use super::simulate::Controller;
use super::suite::Clock;

/// A board of [`plumb_core`], spoken to in frames.
pub(crate) struct BoardController {
    board: Board,
    law_worker: LawWorker,
    outbox: Outbox,
    sequence: u16,
    /// Id of the last request.
    id: u16,
    reached: bool,
    resumed: bool,
    target: Option<Point>,
}

impl BoardController {
    /// A board with this configuration that is told to drive the ball to `target` (metres).
    pub(crate) fn new(config: Config, target: Point3<f64>) -> Self {
        let mut controller = Self {
            board: Board::new(EMULATED),
            law_worker: LawWorker::new(),
            outbox: Outbox::new(),
            sequence: 0,
            id: 0,
            reached: false,
            resumed: false,
            target: Point::from_metres(target.into()),
        };
        controller.send(Micros(0), Command::Hello(Hello::OURS));
        controller.send(Micros(0), Command::Configure(config));
        if let Some(target) = controller.target {
            controller.send(Micros(0), Command::Target(target));
        }
        controller
    }

    /// A board that has stopped because it saw nothing for half a second is sent on when the ball
    /// is seen again.
    fn resume(&mut self, now: Micros, seen: bool) {
        if self.board.state() == State::Fault(Fault::PositionLost) && seen {
            self.resumed = true;
            self.send(now, Command::ClearFault);
        }
        if let (State::Ready, Some(target)) = (self.board.state(), self.target) {
            self.send(now, Command::Target(target));
        }
    }

    fn send(&mut self, now: Micros, command: Command) {
        self.id = self.id.checked_add(1).unwrap_or(1);
        // Every message fits a frame.
        if let Ok(frame) = frame::encode(&ToBoard { id: self.id, command }) {
            self.board.receive(now, &frame, &mut self.outbox);
        }
        self.outbox.clear();
    }
}

impl Controller for BoardController {
    fn see(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>) {
        self.sequence = self.sequence.wrapping_add(1);
        self.resume(now, ball.is_some());
        let ball = ball.and_then(|ball| Point::from_metres(ball.into()));
        let position = Position { sequence: self.sequence, age_us, ball, covariance: None };
        self.send(now, Command::Position(position));
        // Told once: a board may go back from holding to seeking.
        self.reached |= self.board.state() == State::Holding;
    }

    fn tick(&mut self, now: Micros) -> [f64; 3] {
        let _ = self.board.tick(now, &mut self.law_worker, &mut self.outbox);
        self.outbox.clear();
        self.board.positions().map(|p| Steps16(p).to_si())
    }

    fn reached(&self) -> bool {
        self.reached
    }

    fn failed(&self) -> bool {
        let lost = State::Fault(Fault::PositionLost);
        !matches!(self.board.state(), State::Seeking | State::Holding | State::Ready)
            && self.board.state() != lost
    }

    fn resumed(&self) -> bool {
        self.resumed
    }
}

/// A plan made beforehand, a row a millisecond, from when the clock starts.
pub(crate) struct PlanController {
    rows: Vec<[f64; 3]>,
    start: Option<Micros>,
    /// Milliseconds of the plan that are over.
    gone: u64,
}

impl PlanController {
    pub(crate) fn new(rows: Vec<[f64; 3]>, clock: Clock) -> Self {
        Self { rows, start: (clock == Clock::Target).then_some(Micros(0)), gone: 0 }
    }
}

impl Controller for PlanController {
    fn see(&mut self, now: Micros, _: u32, _: Option<Point3<f64>>) {
        self.start.get_or_insert(now);
    }

    fn tick(&mut self, now: Micros) -> [f64; 3] {
        self.gone = self.start.map_or(0, |start| now.since(start) / 1000);
        let row = self.rows.get(self.gone as usize).or(self.rows.last());
        row.copied().unwrap_or_default()
    }

    fn reached(&self) -> bool {
        self.gone >= self.rows.len() as u64
    }

    fn failed(&self) -> bool {
        false
    }
}
