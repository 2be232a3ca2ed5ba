//! A board and its surroundings: the decoders of both directions, the law worker, and a twin.

use plumb_core::{Board, LawWorker, Outbox, Tick};
use plumb_protocol::Config;
use plumb_protocol::diagnostics::ChipCounts;
use plumb_protocol::frame::{Accumulator, FrameError};
use plumb_protocol::measurement::ChipMeasurement;
use plumb_protocol::message::{FromBoard, StartCause};
use plumb_protocol::units::Micros;

use super::delayed_law::DelayedLaw;
use super::event::Snapshot;
use super::invariants::{REPORT, TWIN, UNBROKEN};
use crate::campaign::Outcome;
use crate::frames::Decoder;
use crate::generate;
use crate::random::Random;

/// A second board that receives the same input in different pieces.
struct Twin {
    board: Board,
    out: Outbox,
    law_worker: LawWorker,
}

impl Twin {
    fn new(board: Board) -> Self {
        Self { board, out: Outbox::new(), law_worker: LawWorker::new() }
    }
}

/// Execution of the law.
enum LawExecution {
    /// Immediate, in [`Board::tick`].
    Immediate(Box<LawWorker>),
    /// Delayed, between [`Board::plan`] and [`Board::report`] of later ticks.
    Delayed(Box<DelayedLaw>),
}

/// A board with its surroundings. Every input goes to the board and to its twin, if there is one.
pub(super) struct Chip {
    board: Board,
    twin: Option<Twin>,
    law: LawExecution,
    out: Outbox,
    accumulator: Accumulator,
    /// Reference decoder of the bytes to the board.
    decoder: Decoder,
    /// Whether the build has storage.
    storage: bool,
    /// Messages of the board in the last event.
    replies: Vec<FromBoard>,
}

impl Chip {
    /// Returns a chip with random features.
    pub(super) fn new(random: &mut Random) -> Self {
        let law = if random.percent(30) {
            LawExecution::Delayed(Box::default())
        } else {
            LawExecution::Immediate(Box::default())
        };
        let storage = random.percent(90);
        let board = || Board::new(generate::build(storage));
        Self {
            board: board(),
            twin: random.one_in(8).then(|| Twin::new(board())),
            law,
            out: Outbox::new(),
            accumulator: Accumulator::new(),
            decoder: Decoder::default(),
            storage,
            replies: Vec::new(),
        }
    }

    pub(super) fn board(&self) -> &Board {
        &self.board
    }

    /// Returns the board's current values.
    pub(super) fn snapshot(&self) -> Snapshot {
        Snapshot::of(&self.board)
    }

    pub(super) fn has_twin(&self) -> bool {
        self.twin.is_some()
    }

    /// Returns the board's messages in the last event.
    pub(super) fn replies(&self) -> &[FromBoard] {
        &self.replies
    }

    /// Decodes bytes to the board with the reference decoder. Returns the first message or error.
    pub(super) fn decode(&mut self, bytes: &[u8]) -> Option<Result<Vec<u8>, FrameError>> {
        bytes.iter().filter_map(|byte| self.decoder.push(*byte)).next()
    }

    /// Sends bytes to the board, in random pieces; to the twin, byte by byte.
    pub(super) fn receive(
        &mut self,
        bytes: &[u8],
        at: u64,
        random: &mut Random,
        outcome: &mut Outcome,
    ) {
        let mut rest = bytes;
        while !rest.is_empty() {
            let whole = !random.percent(30);
            let count =
                if whole { rest.len() } else { 1 + random.below(rest.len() as u64) as usize };
            self.board.receive(Micros(at), &rest[..count], &mut self.out);
            rest = &rest[count..];
        }
        if let Some(twin) = &mut self.twin {
            for byte in bytes {
                twin.board.receive(Micros(at), &[*byte], &mut twin.out);
            }
        }
        self.collect_replies(outcome);
    }

    /// Records a new configuration of the board.
    pub(super) fn on_configured(&mut self) {
        if let LawExecution::Delayed(law) = &mut self.law {
            law.on_configured();
        }
    }

    /// Executes a tick. Returns the board's requests to its chip, if they may have changed.
    pub(super) fn tick(
        &mut self,
        now: u64,
        random: &mut Random,
        outcome: &mut Outcome,
    ) -> Option<Tick> {
        let requests = match &mut self.law {
            LawExecution::Immediate(law_worker) => {
                if let Some(twin) = &mut self.twin {
                    let _ = twin.board.tick(Micros(now), &mut twin.law_worker, &mut twin.out);
                }
                self.board.tick(Micros(now), law_worker, &mut self.out)
            }
            LawExecution::Delayed(law) => {
                let board = &mut self.board;
                law.deliver(now, board, self.twin.as_mut().map(|twin| &mut twin.board));
                let requests = board.plan(Micros(now), &mut self.out);
                let plan = *board.pulses();
                board.report(Micros(now), &mut self.out);
                outcome.check(plan == *board.pulses(), REPORT, || format!("{plan:?}"));
                if let Some(twin) = &mut self.twin {
                    let _ = twin.board.plan(Micros(now), &mut twin.out);
                    twin.board.report(Micros(now), &mut twin.out);
                }
                let twin = self.twin.as_mut().map(|twin| &mut twin.board);
                law.take_request(now, board, twin, random, outcome);
                requests
            }
        };
        self.compare_with_twin(outcome);
        self.collect_replies(outcome);
        requests
    }

    /// Reports the end of a Store to the board.
    pub(super) fn on_stored(&mut self, now: u64, written: bool, outcome: &mut Outcome) {
        self.board.on_stored(Micros(now), written, &mut self.out);
        if let Some(twin) = &mut self.twin {
            twin.board.on_stored(Micros(now), written, &mut twin.out);
        }
        self.collect_replies(outcome);
    }

    /// Tells the board the chip's counts.
    pub(super) fn on_diagnosed(&mut self, outcome: &mut Outcome) {
        self.board.on_diagnosed(ChipCounts::default(), &mut self.out);
        if let Some(twin) = &mut self.twin {
            twin.board.on_diagnosed(ChipCounts::default(), &mut twin.out);
        }
        self.collect_replies(outcome);
    }

    /// Tells the board what the chip has measured.
    pub(super) fn on_measured(&mut self, now: u64, outcome: &mut Outcome) {
        let measured = Some(ChipMeasurement::default());
        self.board.on_measured(Micros(now), measured, &mut self.out);
        if let Some(twin) = &mut self.twin {
            twin.board.on_measured(Micros(now), measured, &mut twin.out);
        }
        self.collect_replies(outcome);
    }

    /// Reports an emergency stop to the board; `missing` are the pulses that were not executed.
    pub(super) fn on_emergency(&mut self, now: u64, missing: [i32; 3], outcome: &mut Outcome) {
        self.board.on_emergency_stop(Micros(now), missing, &mut self.out);
        if let Some(twin) = &mut self.twin {
            twin.board.on_emergency_stop(Micros(now), missing, &mut twin.out);
        }
        self.collect_replies(outcome);
    }

    /// Restarts the board, with the stored configuration, if there is one.
    pub(super) fn restart(&mut self, cause: StartCause, stored: Option<&Config>) {
        let storage = self.storage;
        let board = || {
            let mut board = Board::new(generate::build(storage));
            board.set_start_cause(cause);
            if let Some(config) = stored {
                board.restore(config);
            }
            board
        };
        self.board = board();
        self.twin = self.twin.take().map(|_| Twin::new(board()));
        self.law = match self.law {
            LawExecution::Immediate(_) => LawExecution::Immediate(Box::default()),
            LawExecution::Delayed(_) => LawExecution::Delayed(Box::default()),
        };
        (self.out, self.accumulator) = (Outbox::new(), Accumulator::new());
        self.decoder = Decoder::default();
    }

    /// Parses the board's output into [`Chip::replies`].
    fn collect_replies(&mut self, outcome: &mut Outcome) {
        self.replies.clear();
        let out = &mut self.out;
        if let Some(twin) = &mut self.twin {
            outcome.check(out.bytes() == twin.out.bytes(), TWIN, || {
                format!("sends {:?} and {:?}", out.bytes().to_vec(), twin.out.bytes())
            });
            twin.out.clear();
        }
        if out.is_empty() {
            return;
        }
        for byte in out.bytes() {
            match self.accumulator.push::<FromBoard>(*byte) {
                None => {}
                Some(Ok(message)) => self.replies.push(message),
                Some(Err(error)) => outcome.broken(UNBROKEN, || error.to_string()),
            }
        }
        out.clear();
        outcome.check(out.dropped() == 0, UNBROKEN, || "a message did not fit".into());
    }

    /// Checks that the twin has the same state and pulses.
    fn compare_with_twin(&self, outcome: &mut Outcome) {
        let Some(twin) = &self.twin else { return };
        let (ours, theirs) = (self.snapshot(), Snapshot::of(&twin.board));
        let (pulses, other) = (*self.board.pulses(), *twin.board.pulses());
        outcome.check(theirs == ours && other == pulses, TWIN, || {
            format!("{theirs:?} {other:?} and {ours:?} {pulses:?}")
        });
    }
}
