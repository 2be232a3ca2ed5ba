//! Commands of this node whose outcome is due.

use plumb_runtime::operator::{
    CommandOutcome, CommandRefusal, OperatorCommand, OperatorSender, SendCommandError, Stop,
};

use crate::service::Ticket;

/// Number of commands whose outcome is awaited. A Stop beyond it is carried out without an answer.
const MAX_PENDING: usize = 256;

/// Sender of a command in ROS 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    /// The topic of the targets.
    Target,
    /// A request of the service with this index.
    Request {
        /// Index of the service.
        service: usize,
        /// Identity of the request.
        ticket: Ticket,
    },
    /// Nobody who waits for an answer: the request has it already, or the node itself.
    Answered,
}

/// Command with its sender.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pending {
    number: u64,
    command: OperatorCommand,
    origin: Origin,
}

/// Outcome of a command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Settled {
    /// Sender of the command.
    pub(crate) origin: Origin,
    /// The command.
    pub(crate) command: OperatorCommand,
    /// Its outcome.
    pub(crate) outcome: CommandOutcome,
}

/// Commands of this node: sent, and with their outcomes.
#[derive(Debug)]
pub(crate) struct Ledger {
    operator: OperatorSender,
    pending: Vec<Pending>,
    settled: Vec<Settled>,
}

impl Ledger {
    /// Returns a ledger without commands. Those of the services go to `operator`.
    pub(crate) fn new(operator: OperatorSender) -> Self {
        Self { operator, pending: Vec::new(), settled: Vec::new() }
    }

    /// Sends a command of a service to the control loop.
    ///
    /// # Errors
    /// As [`OperatorSender::send`].
    pub(crate) fn send(
        &mut self,
        command: OperatorCommand,
        origin: Origin,
    ) -> Result<(), SendCommandError> {
        let operator = self.operator.clone();
        self.send_from(&operator, command, origin)
    }

    /// Sends a command of `source` to the control loop.
    ///
    /// # Errors
    /// As [`OperatorSender::send`].
    pub(crate) fn send_from(
        &mut self,
        source: &OperatorSender,
        command: OperatorCommand,
        origin: Origin,
    ) -> Result<(), SendCommandError> {
        let number = source.send(command)?;
        if self.pending.len() < MAX_PENDING {
            self.pending.push(Pending { number, command, origin });
        }
        Ok(())
    }

    /// Ends the Stop `stop`.
    ///
    /// # Errors
    /// Where another one holds, or none.
    pub(crate) fn resume(&self, stop: u64) -> Result<(), SendCommandError> {
        self.operator.send(OperatorCommand::Resume { stop }).map(drop)
    }

    /// Returns the Stop of anybody that holds. Targets are refused then.
    pub(crate) fn stop(&self) -> Option<Stop> {
        self.operator.stop()
    }

    /// Notes the outcome of the command `number`, of this or another sender. An outcome of a Stop
    /// is that of the Stops before it, which it replaced: that they were replaced is no outcome.
    /// Returns whether this node has sent the command.
    pub(crate) fn settle(
        &mut self,
        number: u64,
        command: OperatorCommand,
        outcome: CommandOutcome,
    ) -> bool {
        let is_own = self.pending.iter().any(|pending| pending.number == number);
        let is_stop = command == OperatorCommand::Stop;
        if is_stop && outcome == CommandOutcome::Refused(CommandRefusal::Replaced) {
            return is_own;
        }
        let is_meant = |pending: &mut Pending| {
            pending.number == number
                || is_stop && pending.command == command && pending.number < number
        };
        for Pending { command, origin, .. } in self.pending.extract_if(.., is_meant) {
            self.settled.push(Settled { origin, command, outcome });
        }
        is_own
    }

    /// Gives this outcome to every command that has none.
    pub(crate) fn settle_all(&mut self, outcome: CommandOutcome) {
        for Pending { command, origin, .. } in self.pending.drain(..) {
            self.settled.push(Settled { origin, command, outcome });
        }
    }

    /// Removes and returns the outcomes of this node's commands.
    pub(crate) fn take_settled(&mut self) -> Vec<Settled> {
        std::mem::take(&mut self.settled)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use plumb_runtime::operator::{Stopped, operator};

    use super::*;

    #[test]
    fn an_outcome_finds_its_sender() {
        let (sender, _receiver) = operator();
        // A command of another sender, such as the page.
        let other = sender.send(OperatorCommand::Hold).unwrap();
        let mut ledger = Ledger::new(sender);
        let target = OperatorCommand::Target(Point3::new(0.4, 0.3, 0.2));
        ledger.send(target, Origin::Target).unwrap();
        ledger.settle(other, OperatorCommand::Hold, CommandOutcome::Accepted);
        assert_eq!(ledger.take_settled(), []);
        ledger.settle(other + 1, target, CommandOutcome::Accepted);
        let settled =
            Settled { origin: Origin::Target, command: target, outcome: CommandOutcome::Accepted };
        assert_eq!(ledger.take_settled(), [settled]);
        assert_eq!(ledger.take_settled(), []);
    }

    #[test]
    fn no_target_follows_a_stop_of_another_sender() {
        let (page, _receiver) = operator();
        let mut ledger = Ledger::new(page.source("ROS 2"));
        let publisher = page.source("a publisher");
        let target = OperatorCommand::Target(Point3::new(0.4, 0.3, 0.2));
        ledger.send_from(&publisher, target, Origin::Target).unwrap();
        // The board has not answered the Stop yet.
        let stop = page.send(OperatorCommand::Stop).unwrap();
        assert_eq!(ledger.stop().unwrap().number, stop);
        let refused = Err(Stopped(stop).into());
        assert_eq!(ledger.send_from(&publisher, target, Origin::Target), refused);
        assert_eq!(ledger.send(OperatorCommand::Hold, Origin::Answered), refused);
        ledger.resume(stop).unwrap();
        assert_eq!(ledger.stop(), None);
    }

    #[test]
    fn a_stop_that_a_later_stop_replaced_has_the_outcome_of_that_one() {
        let (sender, _receiver) = operator();
        let mut ledger = Ledger::new(sender.clone());
        let stop = OperatorCommand::Stop;
        let replaced = CommandOutcome::Refused(CommandRefusal::Replaced);
        ledger.send(stop, Origin::Answered).unwrap();
        // The board has not answered when the Stop of another sender comes, such as the page.
        let other = sender.send(stop).unwrap();
        assert!(ledger.settle(1, stop, replaced));
        assert_eq!(ledger.take_settled(), []);
        assert!(!ledger.settle(other, stop, CommandOutcome::Accepted));
        let settled = ledger.take_settled();
        assert_eq!(settled.len(), 1);
        assert_eq!(settled[0].outcome, CommandOutcome::Accepted);
        // An End has no outcome that would answer the Stop.
        ledger.send(stop, Origin::Answered).unwrap();
        ledger.settle(3, stop, replaced);
        let ended = CommandOutcome::Refused(CommandRefusal::RunEnded);
        ledger.settle_all(ended);
        assert_eq!(ledger.take_settled()[0].outcome, ended);
    }

    #[test]
    fn the_outcome_of_a_stop_answers_those_that_it_replaced() {
        let (sender, _receiver) = operator();
        let mut ledger = Ledger::new(sender);
        let stop = OperatorCommand::Stop;
        for _ in 0..3 {
            ledger.send(stop, Origin::Answered).unwrap();
        }
        ledger.send(OperatorCommand::ClearFault, Origin::Answered).unwrap();
        ledger.settle(3, stop, CommandOutcome::Accepted);
        let settled = ledger.take_settled();
        assert_eq!(settled.len(), 3);
        assert!(settled.iter().all(|settled| settled.command == stop));
    }
}
