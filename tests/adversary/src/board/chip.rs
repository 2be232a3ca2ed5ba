//! A board and its surroundings: the decoders of both directions, the law worker, and a twin.

use plumb_core::config_store::Stored;
use plumb_core::{Board, Tick};
use plumb_emulator::{Harness, LawDelay};
use plumb_protocol::diagnostics::{ChipCounts, ChipMeasurement, PulseCount};
use plumb_protocol::frame::FrameError;
use plumb_protocol::message::{FromBoard, StartCause};
use plumb_protocol::units::Micros;
use plumb_protocol::{MOTORS, MotorList};

use super::delayed_law::DelayedLaw;
use super::event::Snapshot;
use super::invariants::{REPORT, TWIN, UNBROKEN};
use crate::campaign::Outcome;
use crate::frames::Decoder;
use crate::generate;
use crate::random::Random;

/// A board with its surroundings. Every input goes to the board and to its twin, if there is one.
pub(super) struct Chip {
    harness: Harness,
    /// A second board that receives the same input in different pieces.
    twin: Option<Harness>,
    /// A law worker with random delays; `None` where the law takes no time.
    delayed_law: Option<Box<DelayedLaw>>,
    /// Reference decoder of the bytes to the board.
    decoder: Decoder,
    /// Messages of the board in the last event.
    replies: Vec<FromBoard>,
}

impl Chip {
    /// Returns a chip with random features.
    pub(super) fn new(random: &mut Random) -> Self {
        let delayed_law = random.percent(30).then(Box::default);
        let storage = random.percent(90);
        let harness = || Harness::new(generate::build(storage), LawDelay::SameTick);
        Self {
            harness: harness(),
            twin: random.one_in(8).then(harness),
            delayed_law,
            decoder: Decoder::default(),
            replies: Vec::new(),
        }
    }

    pub(super) fn board(&self) -> &Board {
        &self.harness.board
    }

    /// Returns the board's current values.
    pub(super) fn snapshot(&self) -> Snapshot {
        Snapshot::of(&self.harness.board)
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
            self.harness.receive(Micros(at), &rest[..count]);
            rest = &rest[count..];
        }
        if let Some(twin) = &mut self.twin {
            for byte in bytes {
                twin.receive(Micros(at), &[*byte]);
            }
        }
        self.collect_replies(outcome);
    }

    /// Records a new configuration of the board.
    pub(super) fn on_configured(&mut self) {
        if let Some(law) = &mut self.delayed_law {
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
        let requests = match &self.delayed_law {
            None => {
                if let Some(twin) = &mut self.twin {
                    let _ = twin.tick(Micros(now));
                }
                self.harness.tick(Micros(now))
            }
            Some(_) => self.tick_with_delayed_law(now, random, outcome),
        };
        self.compare_with_twin(outcome);
        self.collect_replies(outcome);
        requests
    }

    /// Executes a tick with the law worker with random delays.
    fn tick_with_delayed_law(
        &mut self,
        now: u64,
        random: &mut Random,
        outcome: &mut Outcome,
    ) -> Option<Tick> {
        let law = self.delayed_law.as_mut()?;
        let response = law.take_response(now);
        let requests = self.harness.plan(Micros(now), response);
        let plan = *self.harness.board.pulses();
        let request = self.harness.report(Micros(now));
        let after = self.harness.board.pulses();
        outcome.check(plan == *after, REPORT, || format!("{plan:?}"));
        if let Some(twin) = &mut self.twin {
            let _ = twin.plan(Micros(now), response);
            let other = twin.report(Micros(now));
            outcome.check(other == request, TWIN, || format!("requests {other:?} and {request:?}"));
        }
        if let Some(request) = request {
            law.on_request(now, &request, random, outcome);
        }
        requests
    }

    /// Reports the end of a Store to the board.
    pub(super) fn on_stored(&mut self, now: u64, written: bool, outcome: &mut Outcome) {
        self.harness.on_stored(Micros(now), written);
        if let Some(twin) = &mut self.twin {
            twin.on_stored(Micros(now), written);
        }
        self.collect_replies(outcome);
    }

    /// Tells the board the chip's counts.
    pub(super) fn on_diagnosed(&mut self, outcome: &mut Outcome) {
        self.harness.on_diagnosed(ChipCounts::default());
        if let Some(twin) = &mut self.twin {
            twin.on_diagnosed(ChipCounts::default());
        }
        self.collect_replies(outcome);
    }

    /// Tells the board what the chip has measured.
    pub(super) fn on_measured(&mut self, now: u64, outcome: &mut Outcome) {
        let pulses = MotorList::new([PulseCount::default(); MOTORS]);
        let measured = Some(ChipMeasurement { pulses, ..ChipMeasurement::default() });
        self.harness.on_measured(Micros(now), measured);
        if let Some(twin) = &mut self.twin {
            twin.on_measured(Micros(now), measured);
        }
        self.collect_replies(outcome);
    }

    /// Reports an emergency stop to the board; `missing` are the pulses that were not executed.
    pub(super) fn on_emergency(&mut self, now: u64, missing: [i32; 3], outcome: &mut Outcome) {
        self.harness.on_emergency_stop(Micros(now), missing);
        if let Some(twin) = &mut self.twin {
            twin.on_emergency_stop(Micros(now), missing);
        }
        self.collect_replies(outcome);
    }

    /// Restarts the board, with the stored configuration, if there is one.
    pub(super) fn restart(&mut self, cause: StartCause, stored: Option<&Stored>) {
        self.harness.restart(cause, stored);
        if let Some(twin) = &mut self.twin {
            twin.restart(cause, stored);
        }
        if let Some(law) = &mut self.delayed_law {
            **law = DelayedLaw::default();
        }
        self.decoder = Decoder::default();
    }

    /// Parses the board's output into [`Chip::replies`].
    fn collect_replies(&mut self, outcome: &mut Outcome) {
        self.replies.clear();
        if let Some(twin) = &mut self.twin {
            let (ours, theirs) = (self.harness.outbox.bytes(), twin.outbox.bytes());
            outcome.check(ours == theirs, TWIN, || format!("sends {ours:?} and {theirs:?}"));
            twin.outbox.clear();
        }
        if self.harness.outbox.is_empty() {
            return;
        }
        for message in self.harness.take_messages() {
            match message {
                Ok(message) => self.replies.push(message),
                Err(error) => outcome.broken(UNBROKEN, || error.to_string()),
            }
        }
        let dropped = self.harness.outbox.dropped();
        outcome.check(dropped == 0, UNBROKEN, || "a message did not fit".into());
    }

    /// Checks that the twin has the same state and pulses.
    fn compare_with_twin(&self, outcome: &mut Outcome) {
        let Some(twin) = &self.twin else { return };
        let (ours, theirs) = (self.snapshot(), Snapshot::of(&twin.board));
        let (pulses, other) = (*self.harness.board.pulses(), *twin.board.pulses());
        outcome.check(theirs == ours && other == pulses, TWIN, || {
            format!("{theirs:?} {other:?} and {ours:?} {pulses:?}")
        });
    }
}
