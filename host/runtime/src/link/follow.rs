//! The path that a board follows: one message after the other, each of which replaces the one
//! before. A lost one is not repeated.

use std::collections::VecDeque;

use plumb_protocol::message::Reference;

use super::*;

/// Number of messages whose answers and telemetry count: those of 2 s at 30 Hz.
const MESSAGES: usize = 60;

/// Messages of a path.
#[derive(Debug, Clone)]
pub(super) struct PathRequest {
    /// Ids of the last messages, the newest one last.
    ids: VecDeque<u16>,
    /// Number of the newest messages whose motions come to rest at one place.
    same_rest: usize,
    first_sent: Duration,
    is_accepted: bool,
    refusal: Option<Refusal>,
}

impl PathRequest {
    fn new(now: Duration) -> Self {
        let (ids, same_rest) = (VecDeque::new(), 0);
        Self { ids, same_rest, first_sent: now, is_accepted: false, refusal: None }
    }

    fn push(&mut self, id: u16) {
        if self.ids.len() == MESSAGES {
            self.ids.pop_front();
        }
        self.ids.push_back(id);
        self.same_rest += 1;
    }

    /// Returns whether a command with this id is a message of the path.
    pub(super) fn has(&self, id: u16) -> bool {
        self.ids.contains(&id)
    }

    /// Returns whether a command with this id is a message whose motion comes to rest where that of
    /// the newest one does.
    fn has_same_rest(&self, id: u16) -> bool {
        self.ids.iter().rev().take(self.same_rest).any(|known| *known == id)
    }

    /// Takes in an answer. Returns the fault for which the board refuses the path.
    pub(super) fn note_answer(&mut self, answer: &Answer) -> Option<Fault> {
        if !self.has(answer.id) {
            return None;
        }
        match answer.refusal {
            None => self.is_accepted = true,
            // A newer message was faster.
            Some(Refusal::ReferenceOutOfOrder) => {}
            Some(Refusal::Faulted(fault)) => return Some(fault),
            refusal => self.refusal = self.refusal.or(refusal),
        }
        None
    }

    /// Takes in telemetry: where it names a message, the board has accepted the path.
    pub(super) fn note_telemetry(&mut self, telemetry: &Telemetry) {
        self.is_accepted |= telemetry.target.is_some_and(|id| self.has(id));
    }
}

impl<T: Transport> Link<T> {
    /// Sends the part of a path that comes next, without waiting. The first message replaces the
    /// present target. [`poll`](Self::poll) fails where the board refuses the path, or answers none
    /// of its messages. The messages get numbers that grow.
    ///
    /// # Errors
    /// Where the link is lost.
    pub fn follow(&mut self, reference: Reference) -> Result<(), LinkError> {
        self.references = self.references.wrapping_add(1);
        let reference = Reference { sequence: self.references, ..reference };
        let id = self.post(Command::Follow(reference))?;
        let now = self.transport.now();
        self.target = None;
        self.path.get_or_insert_with(|| PathRequest::new(now)).push(id);
        Ok(())
    }

    /// Returns the newest telemetry if it is about the path that was sent last.
    pub fn path_telemetry(&self) -> Option<&Telemetry> {
        self.path.as_ref().and_then(|_| self.target_telemetry())
    }

    /// Gives up the path that was sent: the next message begins another one.
    pub fn leave_path(&mut self) {
        self.path = None;
    }

    /// Notes that the motion of the newest message comes to rest at another place than those of the
    /// messages before.
    pub fn note_new_rest(&mut self) {
        if let Some(path) = &mut self.path {
            path.same_rest = 1;
        }
    }

    /// Returns the newest telemetry if it is about a message whose motion comes to rest where that
    /// of the newest one does. Other telemetry says nothing about the ball at that place.
    pub fn rest_telemetry(&self) -> Option<&Telemetry> {
        let path = self.path.as_ref()?;
        self.telemetry().filter(|it| it.target.is_some_and(|id| path.has_same_rest(id)))
    }

    /// Checks that the board has not refused the path, and has answered.
    pub(super) fn check_path(&self) -> Result<(), LinkError> {
        let Some(path) = &self.path else { return Ok(()) };
        if self.fault.is_some() {
            // The fault is the cause, and is reported as such.
            return Ok(());
        }
        if let Some(refusal) = path.refusal {
            return Err(LinkError::Refused { what: "the path", refusal });
        }
        let waited = self.transport.now().saturating_sub(path.first_sent);
        if !path.is_accepted && waited > ANSWER_TIMEOUT {
            return Err(self.silent("the path", ANSWER_TIMEOUT));
        }
        Ok(())
    }
}
