//! The board's own code as a controller, driven through encoded frames.

use nalgebra::Point3;
use plumb_core::{Board, LawWorker, Outbox};
use plumb_emulator::EMULATED;
use plumb_protocol::Config;
use plumb_protocol::frame;
use plumb_protocol::message::{Command, Fault, Hello, Position, State, ToBoard};
use plumb_protocol::units::{Micros, Point, Steps16};

use super::simulate::Controller;

/// A board of [`plumb_core`] that gets its commands as encoded frames.
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
    /// Creates a board with this configuration and sends it `target` (metres, rig frame).
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

    /// Clears the fault of a lost position once the ball is `visible` again, and sends the target
    /// again to a board that is ready.
    fn resume(&mut self, now: Micros, visible: bool) {
        if self.board.state() == State::Fault(Fault::PositionLost) && visible {
            self.resumed = true;
            self.send(now, Command::ClearFault);
        }
        if let (State::Ready, Some(target)) = (self.board.state(), self.target) {
            self.send(now, Command::Target(target));
        }
    }

    /// Sends a command and discards the answer.
    fn send(&mut self, now: Micros, command: Command) {
        self.id = self.id.checked_add(1).unwrap_or(1);
        // Every command fits a frame.
        if let Ok(frame) = frame::encode(&ToBoard { id: self.id, command }) {
            self.board.receive(now, &frame, &mut self.outbox);
        }
        self.outbox.clear();
    }
}

impl Controller for BoardController {
    fn on_position(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>) {
        self.sequence = self.sequence.wrapping_add(1);
        self.resume(now, ball.is_some());
        let ball = ball.and_then(|ball| Point::from_metres(ball.into()));
        let position = Position { sequence: self.sequence, age_us, ball, covariance: None };
        self.send(now, Command::Position(position));
        // Latched: a board can return from holding to seeking.
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
