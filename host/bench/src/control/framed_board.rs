//! The board's own code behind encoded frames.

use plumb_core::{Board, LawWorker, Outbox};
use plumb_emulator::EMULATED;
use plumb_protocol::Config;
use plumb_protocol::frame::{self, Accumulator};
use plumb_protocol::message::{Command, FromBoard, Hello, State, ToBoard};
use plumb_protocol::units::{Micros, Steps16};

/// A board of [`plumb_core`] that gets its commands as encoded frames.
pub(super) struct FramedBoard {
    board: Board,
    law_worker: LawWorker,
    outbox: Outbox,
    accumulator: Accumulator,
    /// Id of the last request.
    id: u16,
}

impl FramedBoard {
    /// Creates a board that has been greeted and has this configuration.
    pub(super) fn new(config: Config) -> Self {
        let mut board = Self {
            board: Board::new(EMULATED),
            law_worker: LawWorker::new(),
            outbox: Outbox::new(),
            accumulator: Accumulator::new(),
            id: 0,
        };
        board.send(Micros(0), Command::Hello(Hello::OURS));
        board.send(Micros(0), Command::Configure(config));
        board
    }

    /// Sends a command.
    pub(super) fn send(&mut self, now: Micros, command: Command) {
        self.id = self.id.checked_add(1).unwrap_or(1);
        // Every command fits a frame.
        if let Ok(frame) = frame::encode(&ToBoard { id: self.id, command }) {
            self.board.receive(now, &frame, &mut self.outbox);
        }
    }

    /// Runs the tick that begins at `now`. Returns the motors' positions at its end, full steps.
    pub(super) fn tick(&mut self, now: Micros) -> [f64; 3] {
        let _ = self.board.tick(now, &mut self.law_worker, &mut self.outbox);
        self.board.positions().map(|p| Steps16(p).to_si())
    }

    /// Passes the messages that the board has sent to `handle`.
    pub(super) fn receive(&mut self, mut handle: impl FnMut(FromBoard)) {
        for &byte in self.outbox.bytes() {
            if let Some(Ok(message)) = self.accumulator.push(byte) {
                handle(message);
            }
        }
        self.outbox.clear();
    }

    /// Discards the messages that the board has sent.
    pub(super) fn discard_messages(&mut self) {
        self.outbox.clear();
    }

    /// Returns the board's state.
    pub(super) fn state(&self) -> State {
        self.board.state()
    }
}
