//! Commands of the operator in the control loop.

use plumb_protocol::message::{Command, State, Telemetry};

use super::control_loop::ControlLoop;
use super::error::ControlLoopError;
use super::waypoint::Waypoint;
use crate::link::Transport;
use crate::observer::RunEvent;
use crate::operator::{
    CommandOutcome, CommandRefusal, OperatorCommand, OperatorReceiver, StopEvent, Submitted,
};
use crate::stop_reason::StopReason;

impl<T: Transport> ControlLoop<'_, '_, T> {
    /// Returns whether an operator ends the run.
    pub(super) fn is_operated(&self) -> bool {
        self.parts.operator.is_some()
    }

    /// Sends the operator's commands to the board, one after the other: the next one after the
    /// answer to the one before, a Stop at once. Returns whether the operator ends the run.
    ///
    /// # Errors
    /// Where the link is lost.
    pub(super) fn obey(&mut self) -> Result<bool, ControlLoopError> {
        let Some(operator) = &self.parts.operator else { return Ok(false) };
        for replaced in operator.take_replaced() {
            self.refuse(replaced, CommandRefusal::Replaced);
        }
        while let Some(submitted) = self.take_command() {
            if let Some(before) = self.in_flight.take() {
                self.refuse(before, CommandRefusal::Replaced);
            }
            match submitted.command.on_wire(self.rules) {
                Err(refusal) => self.refuse(submitted, refusal),
                Ok(Some(command)) => self.submit(submitted, command)?,
                Ok(None) => {
                    self.emit_outcome(submitted, CommandOutcome::Accepted);
                    return Ok(true);
                }
            }
        }
        self.handle_stop_events();
        Ok(false)
    }

    /// Reports what became of the operator's Stops. A motion that was begun before a Resume does
    /// not go on after it.
    fn handle_stop_events(&mut self) {
        let Some(operator) = &self.parts.operator else { return };
        for event in operator.take_stop_events() {
            if let StopEvent::Resumed { number, stop, .. } = &event {
                self.cancel_targets();
                let command = OperatorCommand::Resume { stop: stop.number };
                let submitted = Submitted { number: *number, command };
                self.emit_outcome(submitted, CommandOutcome::Accepted);
            }
            self.emit(&RunEvent::Stop(event));
        }
    }

    /// Returns whether a Stop of an operator holds, or waits.
    pub(super) fn is_stopped(&self) -> bool {
        self.parts.operator.as_ref().is_some_and(OperatorReceiver::is_stopped)
    }

    /// Removes and returns the operator's next command; while an answer is due, only a Stop or End.
    fn take_command(&self) -> Option<Submitted> {
        let is_busy = self.in_flight.is_some() || self.link.is_answer_due();
        self.parts.operator.as_ref()?.take(is_busy)
    }

    /// Sends a command to the board.
    fn submit(&mut self, submitted: Submitted, command: Command) -> Result<(), ControlLoopError> {
        self.link.submit(command)?;
        self.in_flight = Some(submitted);
        match submitted.command {
            OperatorCommand::Stop | OperatorCommand::RampDown => {
                self.is_settling = false;
                self.leave_list(StopReason::Stopped);
            }
            // The ball may reach its target before the answer comes. No other follows then.
            OperatorCommand::Hold => self.cancel_list(),
            // The next message of a path or of a moving target would replace the target.
            OperatorCommand::Target(_) => {
                self.cancel_path();
                self.cancel_targets();
            }
            _ => {}
        }
        Ok(())
    }

    /// Handles the board's answer to the operator's last command, where it has come, and the end
    /// of a Hold's wait for the ball to come to rest.
    pub(super) fn handle_reply(&mut self) {
        // A Stop of the control loop itself has no operator.
        if let Some(reply) = self.link.reply()
            && let Some(submitted) = self.in_flight.take()
        {
            self.answered_at = self.link.telemetry().map(|telemetry| telemetry.time);
            match reply {
                Ok(()) => self.carried_out(submitted),
                Err(refusal) => self.refuse(submitted, CommandRefusal::Board(refusal)),
            }
        }
        self.follow_hold();
    }

    /// Takes the ball's place as the target once the board holds the ball there. Until then a Hold
    /// that the board has accepted ramps the motors down, and the ball moves on.
    fn follow_hold(&mut self) {
        let holds = |telemetry: &Telemetry| telemetry.state == State::Holding;
        if self.is_settling && self.link.target_telemetry().is_some_and(holds) {
            self.is_settling = false;
            self.target = self.last_position.unwrap_or(self.target);
        }
    }

    /// Handles a command that the board has carried out.
    fn carried_out(&mut self, submitted: Submitted) {
        self.emit_outcome(submitted, CommandOutcome::Accepted);
        match submitted.command {
            OperatorCommand::Target(target) => {
                self.is_settling = false;
                self.leave_list(StopReason::Replaced);
                self.begin_leg(Waypoint::new(target.into()));
            }
            OperatorCommand::Hold => {
                self.is_settling = true;
                self.leave_list(StopReason::Held);
            }
            // A motion that was begun during the fault does not go on after it.
            OperatorCommand::ClearFault if self.idle_fault.take().is_some() => {
                self.cancel_targets();
            }
            _ => {}
        }
    }

    /// Refuses the commands that have no outcome at the end of the run, and all further ones.
    pub(super) fn close_operator(&mut self) {
        let waiting = self.parts.operator.as_ref().map(|operator| operator.close());
        for submitted in self.in_flight.take().into_iter().chain(waiting.into_iter().flatten()) {
            self.refuse(submitted, CommandRefusal::RunEnded);
        }
    }

    /// Ends the leg under way for `reason`, and the list of targets.
    fn leave_list(&mut self, reason: StopReason) {
        self.cancel_list();
        self.end_leg(reason);
    }

    fn refuse(&mut self, submitted: Submitted, refusal: CommandRefusal) {
        self.emit_outcome(submitted, CommandOutcome::Refused(refusal));
    }

    fn emit_outcome(&mut self, submitted: Submitted, outcome: CommandOutcome) {
        let Submitted { number, command } = submitted;
        self.emit(&RunEvent::Command { number, command, outcome });
    }

    /// Reports a fault of a board that drives to no target, once.
    pub(super) fn note_idle_fault(&mut self) {
        if let Some(fault) = self.link.board_fault()
            && self.idle_fault.is_none()
        {
            self.emit(&RunEvent::BoardStopped { fault });
            self.is_settling = false;
            self.cancel_targets();
        }
        self.idle_fault = self.link.fault();
    }
}
