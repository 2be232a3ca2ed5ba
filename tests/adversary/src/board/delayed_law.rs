//! A law worker with random delays and lost requests.

use plumb_core::LawWorker;
use plumb_core::law_worker::{LawRequest, LawResponse};

use super::event::TICK;
use super::invariants::FRESH_LAW;
use crate::campaign::Outcome;
use crate::random::Random;

/// A law worker whose responses are delayed.
#[derive(Debug, Clone, Default)]
pub(super) struct DelayedLaw {
    law_worker: LawWorker,
    /// The same law, started with the current configuration.
    fresh: LawWorker,
    in_transit: Option<InTransit>,
}

/// A response in transit.
#[derive(Debug, Clone, Copy)]
struct InTransit {
    due: u64,
    response: LawResponse,
}

impl DelayedLaw {
    /// Records a new configuration, which resets the law: only the known rig is left.
    pub(super) fn on_configured(&mut self) {
        self.fresh = LawWorker::new();
        self.fresh.know(self.law_worker.known_rig());
    }

    /// Takes the response that is due, if any.
    pub(super) fn take_response(&mut self, now: u64) -> Option<LawResponse> {
        let due = self.in_transit.take_if(|response| response.due <= now)?;
        Some(due.response)
    }

    /// Takes a request. Loses some of them.
    pub(super) fn on_request(
        &mut self,
        now: u64,
        request: &LawRequest,
        random: &mut Random,
        outcome: &mut Outcome,
    ) {
        outcome.tally.count("law requests");
        if random.one_in(60) {
            outcome.tally.count("law requests lost");
            return;
        }
        let response = self.respond(request, outcome);
        let delay = match random.below(400) {
            0 => 100_000,
            1 => 17_000,
            _ => random.below(4) * TICK,
        };
        self.in_transit = Some(InTransit { due: now + delay, response });
    }

    /// Returns the law's response, and checks it against the law that was reset.
    fn respond(&mut self, request: &LawRequest, outcome: &mut Outcome) -> LawResponse {
        let (response, fresh) = (self.law_worker.respond(request), self.fresh.respond(request));
        outcome.check(response == fresh, FRESH_LAW, || {
            format!("answered {response:?}; a law started with the configuration: {fresh:?}")
        });
        response
    }
}
