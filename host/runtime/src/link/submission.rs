//! Commands that are submitted without waiting for their answer: repeated until it comes.

use super::target::TargetRequest;
use super::*;

/// Command without an answer so far.
#[derive(Debug, Clone, Copy)]
pub(super) struct Submission {
    id: u16,
    command: Command,
    first_sent: Duration,
    last_sent: Duration,
}

/// Answer of the board to a submitted command: `Err` with the reason of its refusal.
pub type Reply = Result<(), Refusal>;

impl<T: Transport> Link<T> {
    /// Sends a command without waiting. [`poll`](Self::poll) repeats it until the answer comes,
    /// which [`reply`](Self::reply) returns. A command that was submitted before is given up.
    ///
    /// A Stop also gives up the present target. A Target or Hold becomes the present target once
    /// the board has accepted it.
    ///
    /// # Errors
    /// Where the link is lost.
    pub fn submit(&mut self, command: Command) -> Result<(), LinkError> {
        if matches!(command, Command::Stop) {
            // A target that is repeated after a Stop would move the ball again.
            (self.target, self.path) = (None, None);
        }
        let (id, now) = (self.post(command)?, self.transport.now());
        self.reply = None;
        self.submission = Some(Submission { id, command, first_sent: now, last_sent: now });
        Ok(())
    }

    /// Returns the answer to the command that was submitted last, once.
    pub fn reply(&mut self) -> Option<Reply> {
        self.reply.take()
    }

    /// Returns whether an answer is due. A command that is submitted meanwhile replaces the one
    /// without an answer.
    pub fn is_answer_due(&self) -> bool {
        self.submission.is_some() || self.target.is_some_and(|request| request.is_unanswered())
    }

    /// Sends the submitted command again where it is due.
    ///
    /// # Errors
    /// Where no answer has come in time, or the link is lost.
    pub(super) fn repeat_submission(&mut self) -> Result<(), LinkError> {
        let now = self.transport.now();
        let Some(submission) = &mut self.submission else { return Ok(()) };
        if now.saturating_sub(submission.first_sent) > ANSWER_TIMEOUT {
            return Err(self.silent("a command of the operator", ANSWER_TIMEOUT));
        }
        if now.saturating_sub(submission.last_sent) > REPEAT_AFTER {
            submission.last_sent = now;
            let (id, command) = (submission.id, submission.command);
            debug!(id, "no answer from the board: sending the command again");
            self.send(id, command)?;
        }
        Ok(())
    }

    /// Takes in an answer. Returns whether it is to the submitted command.
    pub(super) fn note_reply(&mut self, answer: &Answer) -> bool {
        let Some(submission) = self.submission.filter(|submission| submission.id == answer.id)
        else {
            return false;
        };
        match answer.refusal {
            None => self.accepted(submission, answer.time),
            Some(refusal) => {
                if let Refusal::Faulted(fault) = refusal {
                    self.note_fault(fault);
                }
                (self.submission, self.reply) = (None, Some(Err(refusal)));
            }
        }
        true
    }

    /// Takes in telemetry: where it names the submitted Target or Hold, the board has accepted it.
    pub(super) fn note_target_in_force(&mut self, telemetry: &Telemetry) {
        let is_named = |submission: &Submission| telemetry.target == Some(submission.id);
        if let Some(submission) = self.submission.filter(is_named) {
            self.accepted(submission, telemetry.time);
        }
    }

    /// Notes that the board carried the submitted command out, at `time` on its clock or before.
    fn accepted(&mut self, submission: Submission, time: Micros) {
        match submission.command {
            Command::Target(_) | Command::Hold => {
                self.path = None;
                self.target = Some(TargetRequest::accepted(submission.id, submission.first_sent));
            }
            // Telemetry and reports of the time before have the old fault.
            Command::ClearFault => {
                self.configured = time;
                if self.fault.take().is_some() {
                    // The board has no target. One that was refused for the fault is no failure.
                    (self.target, self.path) = (None, None);
                }
            }
            _ => {}
        }
        (self.submission, self.reply) = (None, Some(Ok(())));
    }
}
