//! Writes to the flash: of the configuration, and for a test.

use plumb_protocol::message::FromBoard;

use super::super::event::{Delivery, Ticked};
use super::super::requests::writes_flash;
use crate::campaign::Outcome;

/// Each Store and TestFlash has one answer: at once if it is refused, else when the flash is
/// written.
pub(super) const STORED: &str = "every Store is answered once";
/// The configuration is written at standstill, after a Store, and does not change during the write.
pub(super) const QUIET: &str = "nothing changes while storing";

/// Checker of [`STORED`] and [`QUIET`].
#[derive(Debug, Clone, Default)]
pub(super) struct Storage {
    /// Ids of the Stores without an answer.
    waiting: Vec<u16>,
}

impl Storage {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>, outcome: &mut Outcome) {
        let quiet = self.waiting.is_empty() || !delivery.configured();
        outcome.check(quiet, QUIET, || "configured while storing".into());
        let Ok(message) = delivery.message else { return };
        let unanswered = delivery.answers(message.id).next().is_none();
        if writes_flash(&message.command) && unanswered && !self.waiting.contains(&message.id) {
            self.waiting.push(message.id);
        }
    }

    pub(super) fn ticked(&self, ticked: &Ticked<'_>, outcome: &mut Outcome) {
        let writes = ticked.requests.is_some_and(|requests| requests.flash.is_some());
        let asked = !self.waiting.is_empty();
        outcome.check(writes == asked, QUIET, || {
            format!("the board writes: {writes}, Stores without an answer: {:?}", self.waiting)
        });
        let rest = ticked.before.positions == ticked.after.positions && !ticked.pulses();
        outcome.check(!writes || rest, QUIET, || format!("{ticked:?}"));
    }

    pub(super) fn stored(&mut self, replies: &[FromBoard], outcome: &mut Outcome) {
        let mut answered: Vec<u16> = replies
            .iter()
            .filter_map(|reply| match reply {
                FromBoard::Answer(answer) => Some(answer.id),
                _ => None,
            })
            .collect();
        let mut waiting = std::mem::take(&mut self.waiting);
        answered.sort_unstable();
        waiting.sort_unstable();
        outcome
            .check(answered == waiting, STORED, || format!("{answered:?} instead of {waiting:?}"));
    }

    /// Checks that every Store has an answer.
    pub(super) fn end(&self, outcome: &mut Outcome) {
        outcome.check(self.waiting.is_empty(), STORED, || format!("never: {:?}", self.waiting));
    }
}
