//! Commands of the operator in the core of a run, and faults while nothing is driven to.

use plumb_protocol::message::State;

use super::{BoardAction, RunCore};
use crate::link::Reply;
use crate::observer::RunEvent;
use crate::operator::{CommandOutcome, CommandRefusal, OperatorCommand, StopEvent, Submitted};
use crate::run::goal::Goal;
use crate::run::waypoint::Waypoint;
use crate::stop_reason::StopReason;

impl RunCore {
    /// Takes a command of the operator: it goes to the board, is refused, or ends the run.
    pub(super) fn take_command(&mut self, submitted: Submitted, now: f64) {
        if let Some(before) = self.in_flight.take() {
            self.refuse(before, CommandRefusal::Replaced);
        }
        match submitted.command.on_wire(&self.settings.rules) {
            Err(refusal) => self.refuse(submitted, refusal),
            Ok(Some(command)) => {
                self.send(BoardAction::Submit(command));
                self.note_submitted(submitted);
            }
            Ok(None) => {
                self.emit_outcome(submitted, CommandOutcome::Accepted);
                self.conclude(StopReason::Ended, now);
            }
        }
    }

    /// Notes that a command is on its way to the board.
    fn note_submitted(&mut self, submitted: Submitted) {
        self.in_flight = Some(submitted);
        match submitted.command {
            OperatorCommand::Stop | OperatorCommand::RampDown => {
                self.leave_rest();
                self.leave_list(StopReason::Stopped);
            }
            // The ball may reach its target before the answer comes. No other follows then.
            OperatorCommand::Hold => self.cancel_list(),
            // The next part of a path or of a moving target would replace the target.
            OperatorCommand::Target(_) => {
                self.cancel_path();
                self.cancel_targets();
            }
            _ => {}
        }
    }

    /// Refuses a command that a later one replaced before it was taken.
    pub(super) fn refuse_replaced(&mut self, submitted: Submitted) {
        self.refuse(submitted, CommandRefusal::Replaced);
    }

    /// Takes in that a Stop is in force, or is no longer. A motion that was begun before a Resume
    /// does not go on after it.
    pub(super) fn note_stop(&mut self, event: StopEvent) {
        if let StopEvent::Resumed { number, stop, .. } = &event {
            let command = OperatorCommand::Resume { stop: stop.number };
            let submitted = Submitted { number: *number, command };
            self.cancel_targets();
            self.emit_outcome(submitted, CommandOutcome::Accepted);
        }
        self.emit(RunEvent::Stop(event));
    }

    /// Takes in the board's answer to the operator's last command, where it has come, and the end
    /// of a Hold's wait for the ball to come to rest.
    pub(super) fn take_reply(&mut self, reply: Option<Reply>, now: f64) {
        // A Stop of the run itself has no operator.
        if let Some(reply) = reply
            && let Some(submitted) = self.in_flight.take()
        {
            self.answered_at = self.board.telemetry.map(|telemetry| telemetry.time);
            match reply {
                Ok(()) => self.note_carried_out(submitted, now),
                Err(refusal) => self.refuse(submitted, CommandRefusal::Board(refusal)),
            }
        }
        self.note_held();
    }

    /// Takes the ball's place as the target once the board holds the ball there. Until then a Hold
    /// that the board has accepted ramps the motors down, and the ball moves on.
    fn note_held(&mut self) {
        let is_held = self.board.about_target().is_some_and(|it| it.state == State::Holding);
        if matches!(self.goal, Goal::Settling) && is_held {
            self.goal = Goal::Held;
            self.target = self.last_position.or(self.target);
        }
    }

    /// Takes in that the board has carried out a command.
    fn note_carried_out(&mut self, submitted: Submitted, now: f64) {
        self.emit_outcome(submitted, CommandOutcome::Accepted);
        match submitted.command {
            OperatorCommand::Target(target) => {
                self.leave_list(StopReason::Replaced);
                let drive = self.begin_leg(Waypoint::new(target.into()), now);
                self.goal = Goal::Waypoint(drive);
            }
            OperatorCommand::Hold => {
                self.leave_list(StopReason::Held);
                self.goal = Goal::Settling;
            }
            OperatorCommand::Jog { .. }
                if matches!(self.goal, Goal::Idle | Goal::Settling | Goal::Held) =>
            {
                self.goal = Goal::Jogging;
            }
            // A motion that was begun during the fault does not go on after it.
            OperatorCommand::ClearFault if matches!(self.goal, Goal::Faulted(_)) => {
                self.goal = Goal::Idle;
                self.cancel_targets();
            }
            _ => {}
        }
    }

    /// Takes in that the motor of a jog stands, by telemetry after the answer.
    pub(super) fn note_jog_end(&mut self) {
        let Some(telemetry) = self.board.telemetry else { return };
        let is_new = self.answered_at != Some(telemetry.time);
        let is_turning = matches!(telemetry.state, State::Jogging | State::Stopping);
        if matches!(self.goal, Goal::Jogging) && is_new && !is_turning {
            self.goal = Goal::Idle;
        }
    }

    /// Reports a fault of a board that drives to no target, once.
    pub(super) fn note_idle_fault(&mut self) {
        match (self.board.fault, &self.goal) {
            (Some(fault), Goal::Faulted(before)) if *before != fault.fault => {
                self.goal = Goal::Faulted(fault.fault);
            }
            (Some(_), Goal::Faulted(_)) => {}
            (Some(fault), _) => {
                self.emit(RunEvent::BoardStopped { fault });
                self.goal = Goal::Faulted(fault.fault);
                self.cancel_targets();
            }
            (None, Goal::Faulted(_)) => self.goal = Goal::Idle,
            (None, _) => {}
        }
    }

    /// Refuses the command without an outcome at the end of the run, and those that wait.
    pub(super) fn close(&mut self, waiting: Vec<Submitted>) {
        for submitted in self.in_flight.take().into_iter().chain(waiting) {
            self.refuse(submitted, CommandRefusal::RunEnded);
        }
    }

    fn refuse(&mut self, submitted: Submitted, refusal: CommandRefusal) {
        self.emit_outcome(submitted, CommandOutcome::Refused(refusal));
    }

    fn emit_outcome(&mut self, submitted: Submitted, outcome: CommandOutcome) {
        let Submitted { number, command } = submitted;
        self.emit(RunEvent::Command { number, command, outcome });
    }
}
