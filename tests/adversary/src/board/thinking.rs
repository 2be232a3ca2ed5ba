//! The thinker of a session: at once, or late, with questions that get lost.

use plumb_core::think::{Answer, Question};
use plumb_core::{Board, Thinker};

use super::event::TICK;
use super::invariants::{FRESH_LAW, TWIN};
use crate::campaign::Outcome;
use crate::random::Random;

/// A thinker that takes its time.
#[derive(Debug, Clone, Default)]
pub(super) struct Slowly {
    thinker: Thinker,
    /// The same law, which began with the present configuration.
    fresh: Thinker,
    waiting: Option<Waiting>,
}

/// An answer on its way.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    due: u64,
    answer: Answer,
}

impl Slowly {
    /// Takes note that the board was configured: its law knows nothing.
    pub(super) fn configured(&mut self) {
        self.fresh = Thinker::new();
    }

    /// Hands the answer over that is due.
    pub(super) fn deliver(&mut self, now: u64, board: &mut Board, twin: Option<&mut Board>) {
        if let Some(waiting) = self.waiting.take_if(|waiting| waiting.due <= now) {
            board.answered(&waiting.answer);
            if let Some(twin) = twin {
                twin.answered(&waiting.answer);
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
        let question = board.question();
        if let Some(twin) = twin {
            let other = twin.question();
            outcome.check(other == question, TWIN, || format!("asks {other:?} and {question:?}"));
        }
        let Some(question) = question else { return };
        outcome.tally.count("questions");
        if random.one_in(60) {
            outcome.tally.count("questions lost");
            return;
        }
        let answer = self.think(&question, outcome);
        let delay = match random.below(400) {
            0 => 100_000,
            1 => 17_000,
            _ => random.below(4) * TICK,
        };
        self.waiting = Some(Waiting { due: now + delay, answer });
    }

    fn think(&mut self, question: &Question, outcome: &mut Outcome) -> Answer {
        let (answer, fresh) = (self.thinker.answer(question), self.fresh.answer(question));
        outcome.check(answer == fresh, FRESH_LAW, || {
            format!("answered {answer:?}; a law that began with the configuration {fresh:?}")
        });
        answer
    }
}
