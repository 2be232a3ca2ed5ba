//! Commands that a run submits without waiting.

use super::commands::Entry;
use super::*;

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
            self.leave_destination();
        }
        self.commands.give_up(Purpose::Operator);
        self.reply = None;
        self.post_awaited(command, Purpose::Operator, None).map(drop)
    }

    /// Returns the answer to the command that was submitted last, once.
    pub fn reply(&mut self) -> Option<Reply> {
        self.reply.take()
    }

    /// Returns whether an answer is due. A command that is submitted meanwhile replaces the one
    /// without an answer.
    pub fn is_answer_due(&self) -> bool {
        self.commands.has(Purpose::Operator) || self.commands.has(Purpose::Target)
    }

    /// Takes in the answer to the submitted command `entry`.
    pub(super) fn note_reply(&mut self, entry: &Entry, answer: &Answer) {
        match answer.refusal {
            None => self.note_carried_out(entry, answer.time),
            Some(refusal) => {
                if let Refusal::Faulted(fault) = refusal {
                    self.note_fault(fault);
                }
                self.reply = Some(Err(refusal));
            }
        }
    }

    /// Takes in telemetry: where it names the submitted Target or Hold, the board has accepted it.
    pub(super) fn note_target_in_force(&mut self, telemetry: &Telemetry) {
        let Some(id) = telemetry.target else { return };
        if self.commands.get(id).is_some_and(|entry| entry.purpose == Purpose::Operator)
            && let Some(entry) = self.commands.take(id)
        {
            self.note_carried_out(&entry, telemetry.time);
        }
    }

    /// Notes that the board carried a submitted command out, at `time` on its clock or before.
    fn note_carried_out(&mut self, entry: &Entry, time: Micros) {
        match entry.command {
            Command::Target(_) | Command::Hold => self.note_new_target(entry.id),
            // Telemetry and reports of the time before have the old fault.
            Command::ClearFault => {
                self.configured = time;
                if self.fault.take().is_some() {
                    // The board has no target. One that was refused for the fault is no failure.
                    self.leave_destination();
                }
            }
            _ => {}
        }
        self.reply = Some(Ok(()));
    }
}
