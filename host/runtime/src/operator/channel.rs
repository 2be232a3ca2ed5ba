//! Queue of commands from other threads to the control loop.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Waker;

use thiserror::Error;

use super::command::OperatorCommand;
use crate::targets::{TargetReceiver, TargetSender, target_channel};

/// Number of commands that may wait. A Stop or End always has room.
pub const MAX_WAITING: usize = 64;

/// A command and its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Submitted {
    /// Number that the sender received.
    pub(crate) number: u64,
    /// The command.
    pub(crate) command: OperatorCommand,
}

/// Reason why a command was not queued.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SendCommandError {
    /// [`MAX_WAITING`] commands wait already.
    #[error("too many commands wait for the board: try again, or stop")]
    Full,
    /// The run has ended.
    #[error("the run has ended")]
    Ended,
    /// A Stop was queued that the sender does not know of.
    #[error("the rig was stopped")]
    Stopped,
}

/// Sender of an operator's commands. Clones send to the same run.
#[derive(Debug, Clone)]
pub struct OperatorSender {
    queue: Arc<Mutex<Queue>>,
    targets: TargetSender,
}

/// Receiver of an operator's commands, for [`RunParts::operator`](crate::run::RunParts). Commands
/// are refused once it is dropped.
#[derive(Debug)]
pub struct OperatorReceiver {
    queue: Arc<Mutex<Queue>>,
    /// `None` once a run has taken them.
    targets: Option<TargetReceiver>,
}

#[derive(Debug, Default)]
struct Queue {
    waiting: VecDeque<Submitted>,
    /// Number of the last command.
    last: u64,
    /// Number of the last Stop, 0 before the first.
    last_stop: u64,
    /// Ends the control loop's wait for a frame.
    waker: Option<Waker>,
    has_ended: bool,
}

/// Returns the two ends of a new queue of commands.
pub fn operator() -> (OperatorSender, OperatorReceiver) {
    let queue = Arc::new(Mutex::new(Queue::default()));
    let (targets, receiver) = target_channel();
    let sender = OperatorSender { queue: Arc::clone(&queue), targets };
    (sender, OperatorReceiver { queue, targets: Some(receiver) })
}

impl OperatorSender {
    /// Queues a command and wakes the control loop. Returns the number of the command, from 1
    /// upwards, which names it in its [`RunEvent`](crate::observer::RunEvent::Command).
    ///
    /// # Errors
    /// Where too many commands wait, or the run has ended.
    pub fn send(&self, command: OperatorCommand) -> Result<u64, SendCommandError> {
        lock(&self.queue).push(command)
    }

    /// Queues a command of a program, as [`send`](Self::send), unless a Stop was queued after the
    /// one of number `known_stop`: also one that waits for the board still.
    ///
    /// # Errors
    /// As [`send`](Self::send), and [`SendCommandError::Stopped`].
    pub fn send_unless_stopped(
        &self,
        command: OperatorCommand,
        known_stop: u64,
    ) -> Result<u64, SendCommandError> {
        let mut queue = lock(&self.queue);
        if queue.last_stop > known_stop {
            return Err(SendCommandError::Stopped);
        }
        queue.push(command)
    }

    /// Returns the number of the last Stop that was queued; 0 before the first.
    pub fn last_stop(&self) -> u64 {
        lock(&self.queue).last_stop
    }
}

impl Queue {
    /// Queues a command and wakes the control loop. Returns the number of the command.
    fn push(&mut self, command: OperatorCommand) -> Result<u64, SendCommandError> {
        if self.has_ended {
            return Err(SendCommandError::Ended);
        }
        if command.is_urgent() {
            // One of each is enough: a key that is held down does not fill the memory.
            self.waiting.retain(|waiting| waiting.command != command);
        } else if self.waiting.len() >= MAX_WAITING {
            return Err(SendCommandError::Full);
        }
        self.last += 1;
        let number = self.last;
        if command == OperatorCommand::Stop {
            self.last_stop = number;
        }
        self.waiting.push_back(Submitted { number, command });
        if let Some(waker) = &self.waker {
            waker.wake_by_ref();
        }
        Ok(number)
    }
}

impl OperatorSender {
    /// Returns the sender of targets that move. Such a target needs no answer; a Stop, a Hold, a
    /// Target and a fault end its motion.
    pub fn targets(&self) -> &TargetSender {
        &self.targets
    }
}

impl OperatorReceiver {
    /// Removes and returns the receiver of targets that move.
    pub fn take_targets(&mut self) -> Option<TargetReceiver> {
        self.targets.take()
    }

    /// Sets the waker of the control loop's wait for a frame.
    pub(crate) fn set_waker(&self, waker: Option<Waker>) {
        lock(&self.queue).waker = waker;
    }

    /// Removes and returns the commands before the last Stop or End. An End stays.
    pub(crate) fn take_replaced(&self) -> Vec<Submitted> {
        let waiting = &mut lock(&self.queue).waiting;
        let urgent = waiting.iter().rposition(|submitted| submitted.command.is_urgent());
        let Some(index) = urgent else { return Vec::new() };
        let is_end = |it: &Submitted| it.command == OperatorCommand::End;
        let (ends, replaced): (Vec<_>, Vec<_>) = waiting.drain(..index).partition(is_end);
        ends.into_iter().rev().for_each(|end| waiting.push_front(end));
        replaced
    }

    /// Removes and returns the oldest command; with `only_urgent` only if it is a Stop or End.
    pub(crate) fn take(&self, only_urgent: bool) -> Option<Submitted> {
        let waiting = &mut lock(&self.queue).waiting;
        waiting.pop_front_if(|submitted| !only_urgent || submitted.command.is_urgent())
    }

    /// Refuses further commands. Returns those that wait.
    pub(crate) fn close(&self) -> Vec<Submitted> {
        let mut queue = lock(&self.queue);
        (queue.has_ended, queue.waker) = (true, None);
        queue.waiting.drain(..).collect()
    }
}

impl Drop for OperatorReceiver {
    fn drop(&mut self) {
        self.close();
    }
}

fn lock(queue: &Mutex<Queue>) -> MutexGuard<'_, Queue> {
    queue.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn commands(submitted: &[Submitted]) -> Vec<OperatorCommand> {
        submitted.iter().map(|submitted| submitted.command).collect()
    }

    #[test]
    fn a_program_that_does_not_know_of_a_stop_sends_nothing_after_it() {
        use OperatorCommand::{Hold, Stop};
        let (sender, receiver) = operator();
        sender.send_unless_stopped(Hold, sender.last_stop()).unwrap();
        let stop = sender.clone().send(Stop).unwrap();
        assert_eq!(sender.send_unless_stopped(Hold, 0), Err(SendCommandError::Stopped));
        assert_eq!(commands(&receiver.close()), [Hold, Stop]);
        assert_eq!((sender.last_stop(), stop), (2, 2));
    }

    #[test]
    fn an_end_stays_before_a_stop() {
        use OperatorCommand::{End, Hold, Stop};
        let (sender, receiver) = operator();
        for command in [Hold, End, Hold, Stop] {
            sender.send(command).unwrap();
        }
        assert_eq!(commands(&receiver.take_replaced()), [Hold, Hold]);
        assert_eq!(receiver.take(true).map(|it| it.command), Some(End));
    }

    #[test]
    fn a_stop_replaces_what_waits_and_always_has_room() {
        use OperatorCommand::{ClearFault, Hold, Stop};
        let (sender, receiver) = operator();
        for _ in 0..MAX_WAITING {
            sender.send(Hold).unwrap();
        }
        assert_eq!(sender.send(ClearFault), Err(SendCommandError::Full));
        let stops: Vec<u64> = (0..1000).map(|_| sender.send(Stop).unwrap()).collect();
        assert_eq!(commands(&receiver.take_replaced()), [Hold; MAX_WAITING]);
        let stop = receiver.take(true).unwrap();
        assert_eq!((stop.command, Some(&stop.number)), (Stop, stops.last()));
        sender.send(ClearFault).unwrap();
        assert_eq!(receiver.take_replaced(), []);
        assert_eq!(receiver.take(true), None);
        assert_eq!(receiver.take(false).unwrap().command, ClearFault);
        drop(receiver);
        assert_eq!(sender.send(Stop), Err(SendCommandError::Ended));
    }
}
