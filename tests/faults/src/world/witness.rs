//! The witness: passes every event of the board to the invariants of the adversary.

use plumb_adversary::board::event::{Cut, Delivery, Snapshot, TICK, Ticked};
use plumb_adversary::board::invariants::Invariants;
use plumb_adversary::board::requests::Requests;
use plumb_adversary::campaign::Outcome;
use plumb_adversary::frames::Decoder;
use plumb_emulator::EmulatedBoard;
use plumb_protocol::frame::{Accumulator, read};
use plumb_protocol::message::{FromBoard, ToBoard};
use plumb_protocol::units::Micros;

/// Every frame that the board sends is intact.
const INTACT: &str = "the board's frames are intact";

/// Inputs of the board in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Inputs {
    /// Whether the emergency input is open.
    pub(super) is_emergency: bool,
    /// Whether the motor drivers do not answer.
    pub(super) is_driver_silent: bool,
}

/// Checks of one board.
pub(super) struct Witness {
    invariants: Invariants,
    outcome: Outcome,
    requests: Requests,
    /// Reference decoder of the bytes to the board.
    decoder: Decoder,
    /// Decoder of the board's messages.
    accumulator: Accumulator,
    replies: Vec<FromBoard>,
}

impl Witness {
    /// Returns the witness of a board that has just started.
    pub(super) fn new(seed: u64, board: &EmulatedBoard) -> Self {
        Self {
            invariants: Invariants::new(board.core()),
            outcome: Outcome::of(seed),
            requests: Requests::default(),
            decoder: Decoder::default(),
            accumulator: Accumulator::new(),
            replies: Vec::new(),
        }
    }

    /// Returns the broken invariants.
    pub(super) fn violations(&self) -> Vec<String> {
        self.outcome.violations.iter().map(ToString::to_string).collect()
    }

    /// Sends `bytes` to the board. Returns its answers.
    pub(super) fn deliver(&mut self, board: &mut EmulatedBoard, bytes: &[u8]) -> Vec<u8> {
        let mut sent = Vec::new();
        for piece in bytes.split_inclusive(|byte| *byte == 0) {
            let before = Snapshot::of(board.core());
            board.write(piece);
            let replies = board.read();
            self.parse(&replies);
            sent.extend(replies);
            let decoded = piece.iter().filter_map(|byte| self.decoder.push(*byte)).next();
            if let Some(message) = decoded {
                let message = message.and_then(|bytes| read::<ToBoard>(&bytes));
                self.check_delivery(board, message, before);
            }
        }
        sent
    }

    fn check_delivery(
        &mut self,
        board: &EmulatedBoard,
        message: Result<ToBoard, plumb_protocol::frame::FrameError>,
        before: Snapshot,
    ) {
        let repeated = message.is_ok_and(|message| self.requests.is_repetition(&message));
        let (at, after) = (board.now().0, Snapshot::of(board.core()));
        let delivery = Delivery { at, message, repeated, replies: &self.replies, before, after };
        let config = board.core().config();
        self.invariants.delivered(&delivery, config, &mut self.outcome);
        if let Some(accepted) = delivery.accepted() {
            self.requests.record(accepted);
        }
    }

    /// Takes in a restart of the board.
    pub(super) fn restarted(&mut self, board: &EmulatedBoard) {
        self.invariants = Invariants::new(board.core());
        self.requests = Requests::default();
        (self.decoder, self.accumulator) = (Decoder::default(), Accumulator::new());
    }

    /// Opens the emergency input, or keeps it open: the hardware has cut `missing` pulses.
    pub(super) fn cut(&mut self, board: &mut EmulatedBoard, missing: [i32; 3]) -> Vec<u8> {
        let before = Snapshot::of(board.core());
        board.open_emergency(missing);
        let sent = board.read();
        self.parse(&sent);
        let (after, replies) = (Snapshot::of(board.core()), &self.replies[..]);
        self.invariants.cut(&Cut { missing, before, after, replies }, &mut self.outcome);
        sent
    }

    /// Takes in that the emergency input is closed again.
    pub(super) fn closed(&mut self) {
        self.invariants.closed();
    }

    /// Runs the board for a tick with these inputs. Returns its messages.
    pub(super) fn tick(&mut self, board: &mut EmulatedBoard, inputs: Inputs) -> Vec<u8> {
        let (now, before) = (board.now().0, Snapshot::of(board.core()));
        if inputs.is_driver_silent {
            board.fail_driver();
        }
        self.outcome.tick = now / TICK;
        // The rig bears everything: a cable that is too short makes a motor stall.
        let followed = board.run_to(Micros(now + TICK));
        self.outcome.check(followed.is_ok(), "the rig follows", || format!("{followed:?}"));
        let sent = board.read();
        self.parse(&sent);
        let (after, plan) = (Snapshot::of(board.core()), *board.core().pulses());
        let emergency = inputs.is_emergency;
        let (requests, replies) = (board.requests(), &self.replies[..]);
        let ticked = Ticked { now, before, after, plan, requests, replies, emergency };
        self.invariants.ticked(&ticked, &mut self.outcome);
        sent
    }

    /// Parses the board's messages of an event.
    fn parse(&mut self, bytes: &[u8]) {
        self.replies.clear();
        for byte in bytes {
            match self.accumulator.push(*byte) {
                None => {}
                Some(Ok(message)) => self.replies.push(message),
                Some(Err(error)) => self.outcome.broken(INTACT, || error.to_string()),
            }
        }
    }
}
