//! The thinker of a session: at once, or late, with questions that get lost.

use plumb_core::law_worker::{LawRequest, LawResponse};
use plumb_core::{Board, LawWorker};

use super::event::TICK;
use super::invariants::{FRESH_LAW, TWIN};
use crate::campaign::Outcome;
use crate::random::Random;

/// A thinker that takes its time.
#[derive(Debug, Clone, Default)]
pub(super) struct Slowly {
    law_worker: LawWorker,
    /// The same law, which began with the present configuration.
    fresh: LawWorker,
    waiting: Option<Waiting>,
}

/// An answer on its way.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    due: u64,
    response: LawResponse,
}

impl Slowly {
    /// Takes note that the board was configured: its law knows nothing.
    pub(super) fn configured(&mut self) {
        self.fresh = LawWorker::new();
    }

    /// Hands the answer over that is due.
    pub(super) fn deliver(&mut self, now: u64, board: &mut Board, twin: Option<&mut Board>) {
        if let Some(waiting) = self.waiting.take_if(|waiting| waiting.due <= now) {
            board.on_law_response(&waiting.response);
            if let Some(twin) = twin {
                twin.on_law_response(&waiting.response);
            }
        }
    }

    /// Takes up the question that has come up, if any, and loses it at times.
    pub(super) fn ask(
        &mut self,
        now: u64,
        board: &mut Board,
        twin: Option<&mut Board>,
        random: &mut Random,
        outcome: &mut Outcome,
    ) {
        let request = board.take_law_request();
        if let Some(twin) = twin {
            let other = twin.take_law_request();
            outcome.check(other == request, TWIN, || format!("asks {other:?} and {request:?}"));
        }
        let Some(request) = request else { return };
        outcome.tally.count("law requests");
        if random.one_in(60) {
            outcome.tally.count("law requests lost");
            return;
        }
        let response = self.think(&request, outcome);
        let delay = match random.below(400) {
            0 => 100_000,
            1 => 17_000,
            _ => random.below(4) * TICK,
        };
        self.waiting = Some(Waiting { due: now + delay, response });
    }

    fn think(&mut self, request: &LawRequest, outcome: &mut Outcome) -> LawResponse {
        let (response, fresh) = (self.law_worker.respond(request), self.fresh.respond(request));
        outcome.check(response == fresh, FRESH_LAW, || {
            format!("answered {response:?}; a law that began with the configuration {fresh:?}")
        });
        response
    }
}
