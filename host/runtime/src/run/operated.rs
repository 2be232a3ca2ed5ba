//! Commands of the operator in the control loop.

use plumb_protocol::message::{Command, Refusal, State};

use super::control_loop::ControlLoop;
use super::error::ControlLoopError;
use super::waypoint::Waypoint;
use crate::link::Transport;
use crate::observer::RunEvent;
use crate::operator::{CommandOutcome, CommandRefusal, OperatorCommand, Submitted};
use crate::stop_reason::StopReason;

/// Command of the operator that is under way.
#[derive(Debug, Clone, Copy)]
pub(super) struct InFlight {
    submitted: Submitted,
    step: Step,
}

/// Step of a command that is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// The answer to the Stop before a Hold is due.
    Stop,
    /// The motors ramp down before a Hold.
    Rest,
    /// The answer to the command itself is due.
    Command,
}

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
                self.refuse(before.submitted, CommandRefusal::Replaced);
            }
            match submitted.command.on_wire(&self.workspace) {
                Err(refusal) => self.refuse(submitted, refusal),
                Ok(Some(command)) => self.submit(submitted, command)?,
                Ok(None) => {
                    self.emit_outcome(submitted, CommandOutcome::Accepted);
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// Removes and returns the operator's next command; while an answer is due, only a Stop or End.
    fn take_command(&self) -> Option<Submitted> {
        let is_busy = self.in_flight.is_some() || self.link.is_answer_due();
        self.parts.operator.as_ref()?.take(is_busy)
    }

    /// Sends a command to the board. A ball in motion would overshoot the place where a Hold finds
    /// it: the motors ramp down first.
    fn submit(&mut self, submitted: Submitted, command: Command) -> Result<(), ControlLoopError> {
        let state = self.link.telemetry().map(|telemetry| telemetry.state);
        let is_moving = matches!(state, Some(State::Seeking | State::Stopping));
        let (command, step) = match command {
            Command::Hold if is_moving => (Command::Stop, Step::Stop),
            command => (command, Step::Command),
        };
        self.link.submit(command)?;
        self.in_flight = Some(InFlight { submitted, step });
        match submitted.command {
            OperatorCommand::Stop => self.leave_list(StopReason::Stopped),
            OperatorCommand::Hold if step == Step::Stop => self.leave_list(StopReason::Held),
            _ => {}
        }
        Ok(())
    }

    /// Handles the board's answer to the operator's last command, where it has come.
    ///
    /// # Errors
    /// Where the link is lost.
    pub(super) fn handle_reply(&mut self) -> Result<(), ControlLoopError> {
        let reply = self.link.reply();
        // A Stop of the control loop itself has no operator.
        let Some(in_flight) = self.in_flight else { return Ok(()) };
        match (in_flight.step, reply) {
            (Step::Rest, _) => return self.hold_at_rest(in_flight.submitted),
            (_, None) => {}
            (_, Some(Err(refusal))) => {
                self.in_flight = None;
                self.refuse(in_flight.submitted, CommandRefusal::Board(refusal));
            }
            (Step::Stop, Some(Ok(()))) => {
                self.in_flight = Some(InFlight { step: Step::Rest, ..in_flight });
            }
            (Step::Command, Some(Ok(()))) => {
                self.in_flight = None;
                self.carried_out(in_flight.submitted);
            }
        }
        Ok(())
    }

    /// Sends the Hold of a board that has come to rest.
    fn hold_at_rest(&mut self, submitted: Submitted) -> Result<(), ControlLoopError> {
        match self.link.telemetry().map(|telemetry| telemetry.state) {
            Some(State::Ready) => {
                self.link.submit(Command::Hold)?;
                self.in_flight = Some(InFlight { submitted, step: Step::Command });
            }
            Some(State::Fault(fault)) => {
                self.in_flight = None;
                self.refuse(submitted, CommandRefusal::Board(Refusal::Faulted(fault)));
            }
            _ => {}
        }
        Ok(())
    }

    /// Handles a command that the board has carried out.
    fn carried_out(&mut self, submitted: Submitted) {
        self.emit_outcome(submitted, CommandOutcome::Accepted);
        match submitted.command {
            OperatorCommand::Target(target) => {
                self.leave_list(StopReason::Replaced);
                self.begin_leg(Waypoint::new(target.into()));
            }
            OperatorCommand::Hold => {
                self.leave_list(StopReason::Held);
                self.target = self.last_position.unwrap_or(self.target);
            }
            OperatorCommand::ClearFault => self.idle_fault = None,
            _ => {}
        }
    }

    /// Refuses the commands that have no outcome at the end of the run, and all further ones.
    pub(super) fn close_operator(&mut self) {
        let waiting = self.parts.operator.as_ref().map(|operator| operator.close());
        let in_flight = self.in_flight.take().map(|in_flight| in_flight.submitted);
        for submitted in in_flight.into_iter().chain(waiting.into_iter().flatten()) {
            self.refuse(submitted, CommandRefusal::RunEnded);
        }
    }

    /// Ends the leg under way for `reason`, and the list of targets.
    fn leave_list(&mut self, reason: StopReason) {
        self.legs.cancel_list();
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
        let fault = self.link.fault();
        if let Some(fault) = fault
            && self.idle_fault.is_none()
        {
            self.emit(&RunEvent::BoardStopped { fault });
        }
        self.idle_fault = fault;
    }
}
