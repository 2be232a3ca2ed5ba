//! The target that a board is asked for: repeated until the board has accepted it.

use super::*;

/// Request of a target.
#[derive(Debug, Clone, Copy)]
pub(super) struct TargetRequest {
    id: u16,
    /// The target to send again while it is unanswered.
    target: Option<Point>,
    first_sent: Duration,
    last_sent: Duration,
    outcome: Outcome,
}

/// Answer of the board to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    /// It has not answered.
    Unknown,
    Accepted,
    Refused(Refusal),
}

impl TargetRequest {
    /// Returns a target that the board has accepted by the command `id`, sent at `sent`.
    pub(super) fn accepted(id: u16, sent: Duration) -> Self {
        let outcome = Outcome::Accepted;
        Self { id, target: None, first_sent: sent, last_sent: sent, outcome }
    }

    /// Whether the board has neither accepted nor refused the target.
    pub(super) fn is_unanswered(&self) -> bool {
        self.outcome == Outcome::Unknown
    }

    /// Whether an answer is to this request.
    pub(super) fn is_answered_by(&self, answer: &Answer) -> bool {
        self.id == answer.id
    }

    /// Why the board refused the target, if it did.
    pub(super) fn refusal(&self) -> Option<Refusal> {
        match self.outcome {
            Outcome::Refused(refusal) => Some(refusal),
            Outcome::Unknown | Outcome::Accepted => None,
        }
    }

    /// Takes in an answer, the first to this request.
    pub(super) fn note_answer(&mut self, answer: &Answer) {
        if self.is_answered_by(answer) && self.outcome == Outcome::Unknown {
            self.outcome = answer.refusal.map_or(Outcome::Accepted, Outcome::Refused);
        }
    }

    /// Takes in telemetry: where it names this target, the board has accepted it.
    pub(super) fn note_telemetry(&mut self, telemetry: &Telemetry) {
        if telemetry.target == Some(self.id) {
            self.outcome = Outcome::Accepted;
        }
    }
}

impl<T: Transport> Link<T> {
    /// Requests a target, in the rig frame, without waiting: [`poll`](Self::poll) repeats the
    /// request until the board has accepted it, and fails where it refuses. Until then
    /// [`target_telemetry`](Self::target_telemetry) is `None`.
    ///
    /// # Errors
    /// Where the link is lost.
    pub fn request_target(&mut self, target: Point) -> Result<(), LinkError> {
        let (id, now) = (self.post(Command::Target(target))?, self.transport.now());
        debug!(id, "requesting a target");
        let (target, outcome) = (Some(target), Outcome::Unknown);
        self.path = None;
        self.target = Some(TargetRequest { id, target, first_sent: now, last_sent: now, outcome });
        Ok(())
    }

    /// Sets the target, in the rig frame, and waits until the board has accepted it.
    ///
    /// # Errors
    /// Where the board refuses it or has stopped by itself, or the link fails.
    pub fn set_target(&mut self, target: Point) -> Result<(), LinkError> {
        self.request_target(target)?;
        while self.target.is_some_and(|request| request.is_unanswered()) {
            self.listen(POLL_INTERVAL)?;
            self.poll()?;
        }
        match self.target.and_then(|request| request.refusal()) {
            Some(Refusal::Faulted(fault)) => Err(LinkError::Fault(fault)),
            _ => self.check_target(),
        }
    }

    /// Returns the newest telemetry if it is about the target or the path asked for last.
    pub fn target_telemetry(&self) -> Option<&Telemetry> {
        let is_asked_for = |id| match (&self.path, self.target) {
            (Some(path), _) => path.has(id),
            (None, target) => target.is_some_and(|request| request.id == id),
        };
        self.telemetry().filter(|telemetry| telemetry.target.is_some_and(is_asked_for))
    }

    /// Sends the target again where it is due and its answer has not come.
    pub(super) fn repeat_target(&mut self) -> Result<(), LinkError> {
        let now = self.transport.now();
        let Some(request) = &mut self.target else { return Ok(()) };
        let (Outcome::Unknown, Some(target)) = (request.outcome, request.target) else {
            return Ok(());
        };
        if now.saturating_sub(request.first_sent) > ANSWER_TIMEOUT {
            return Err(self.silent("the target", ANSWER_TIMEOUT));
        }
        if now.saturating_sub(request.last_sent) > REPEAT_AFTER {
            request.last_sent = now;
            let id = request.id;
            debug!(id, "no answer from the board: sending the target again");
            self.send(id, Command::Target(target))?;
        }
        Ok(())
    }

    /// Checks that the board has not refused the target.
    pub(super) fn check_target(&self) -> Result<(), LinkError> {
        match self.target.and_then(|request| request.refusal()) {
            // The fault is the cause, and is reported as such.
            Some(Refusal::Faulted(_)) if self.fault.is_some() => Ok(()),
            Some(refusal) => Err(LinkError::Refused { what: "the target", refusal }),
            None => Ok(()),
        }
    }
}
