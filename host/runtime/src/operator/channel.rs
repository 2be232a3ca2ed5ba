//! Queue of commands from other threads to the control loop.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Waker;
use std::time::Instant;

use thiserror::Error;

use super::command::OperatorCommand;
use super::stop_latch::{Continuity, ResumeError, Stop, StopEvent, StopLatch, Stopped, Turn};
use crate::targets::{TargetReceiver, TargetSender, target_channel};

/// Number of commands that may wait. A Stop or End always has room; a Resume never waits.
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
    /// A Stop is in force.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// A Resume ends nothing.
    #[error(transparent)]
    NotResumed(#[from] ResumeError),
    /// The sender was sending when the rig was resumed.
    #[error(
        "the rig was stopped and resumed while this sender went on: begin anew, with a new gesture \
         or after a second of silence"
    )]
    MustBeginAnew,
}

/// Sender of an operator's commands. Clones send to the same run, as the same source;
/// [`source`](Self::source) returns the sender of another one.
#[derive(Debug, Clone)]
pub struct OperatorSender {
    queue: Arc<Mutex<Queue>>,
    targets: TargetSender,
    /// Name of the source, for people.
    name: Arc<str>,
    turn: Arc<Mutex<Turn>>,
}

/// Receiver of an operator's commands, for [`RunParts::operator`](crate::run::RunParts). Commands
/// are refused once it is dropped.
#[derive(Debug)]
pub struct OperatorReceiver {
    queue: Arc<Mutex<Queue>>,
    /// `None` once a run has taken them.
    targets: Option<TargetReceiver>,
}

/// Clock of an operator: it returns the present time.
pub type OperatorClock = Box<dyn Fn() -> Instant + Send>;

struct Queue {
    waiting: VecDeque<Submitted>,
    /// Number of the last command.
    last: u64,
    latch: StopLatch,
    clock: OperatorClock,
    /// Ends the control loop's wait for a frame.
    waker: Option<Waker>,
    has_ended: bool,
}

impl fmt::Debug for Queue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { waiting, last, latch, has_ended, .. } = self;
        let mut fields = f.debug_struct("Queue");
        fields.field("waiting", waiting).field("last", last).field("latch", latch);
        fields.field("has_ended", has_ended).finish_non_exhaustive()
    }
}

/// Returns the two ends of a new queue of commands. The sender is the source "the operator".
pub fn operator() -> (OperatorSender, OperatorReceiver) {
    operator_with_clock(Box::new(Instant::now))
}

/// Returns the two ends of a new queue of commands, as [`operator`] does, whose sources are silent
/// or not by `clock`.
pub fn operator_with_clock(clock: OperatorClock) -> (OperatorSender, OperatorReceiver) {
    let queue = Queue {
        waiting: VecDeque::new(),
        last: 0,
        latch: StopLatch::default(),
        clock,
        waker: None,
        has_ended: false,
    };
    let queue = Arc::new(Mutex::new(queue));
    let (targets, receiver) = target_channel();
    let (name, turn) = (Arc::from("the operator"), Arc::default());
    let sender = OperatorSender { queue: Arc::clone(&queue), targets, name, turn };
    (sender, OperatorReceiver { queue, targets: Some(receiver) })
}

impl OperatorSender {
    /// Returns the sender of another source of the same run: a page, a publisher, a program. `name`
    /// names it for people, in messages about its commands.
    #[must_use]
    pub fn source(&self, name: &str) -> Self {
        let (queue, targets) = (Arc::clone(&self.queue), self.targets.clone());
        Self { queue, targets, name: Arc::from(name), turn: Arc::default() }
    }

    /// Queues a command and wakes the control loop. Returns the number of the command, from 1
    /// upwards, which names it in its [`RunEvent`](crate::observer::RunEvent::Command).
    ///
    /// A Stop is in force from the moment in which it is queued, and a Resume ends it at once.
    ///
    /// # Errors
    /// Where too many commands wait, or the run has ended. A command that moves the ball is refused
    /// while a Stop is in force, and after its Resume until the source begins anew. A Resume is
    /// refused where it names no Stop in force.
    pub fn send(&self, command: OperatorCommand) -> Result<u64, SendCommandError> {
        let queue = &mut lock(&self.queue);
        if queue.has_ended {
            return Err(SendCommandError::Ended);
        }
        if command.moves_the_ball() {
            self.admit(queue, Continuity::MayGoOn, &command)?;
        }
        if let (OperatorCommand::RampDown, Some(stop)) = (command, queue.latch.stop()) {
            return Err(Stopped(stop.number).into());
        }
        if let OperatorCommand::Resume { stop } = command {
            return queue.resume(stop, &self.name);
        }
        queue.push(command, &self.name)
    }

    /// Checks that this source may move the ball with a target of the [moving
    /// targets](Self::targets) now. `continuity` says whether a gesture begins with it.
    ///
    /// # Errors
    /// While a Stop is in force, and after its Resume until the source begins anew.
    pub fn admit_target(&self, continuity: Continuity) -> Result<(), SendCommandError> {
        self.admit(&mut lock(&self.queue), continuity, &"a moving target")
    }

    /// Checks that this source may move the ball now. Counts a refusal; `what` names what would
    /// move it.
    fn admit(
        &self,
        queue: &mut Queue,
        continuity: Continuity,
        what: &dyn ToString,
    ) -> Result<(), SendCommandError> {
        let (turn, now) = (&mut lock(&self.turn), (queue.clock)());
        if let Err(stopped) = queue.latch.admit(&self.name, what) {
            turn.note_refused(continuity, now);
            return Err(stopped.into());
        }
        let may_move = turn.takes(continuity, queue.latch.resumes(), now);
        may_move.then_some(()).ok_or(SendCommandError::MustBeginAnew)
    }

    /// Returns the Stop in force; `None` where the ball may be moved.
    pub fn stop(&self) -> Option<Stop> {
        lock(&self.queue).latch.stop().cloned()
    }

    /// Returns the time of the last Resume; `None` before the first.
    pub fn resumed(&self) -> Option<Instant> {
        lock(&self.queue).latch.resumed()
    }

    /// Returns whether this source has sent nothing that moves the ball for
    /// [`BEGINS_ANEW_AFTER`](super::BEGINS_ANEW_AFTER).
    pub fn is_silent(&self) -> bool {
        let now = (lock(&self.queue).clock)();
        lock(&self.turn).is_silent(now)
    }

    /// Returns the sender of targets that move. Such a target needs no answer; a Stop, a Hold, a
    /// Target and a fault end its motion.
    pub fn targets(&self) -> &TargetSender {
        &self.targets
    }
}

impl Queue {
    /// Queues a command and wakes the control loop. Returns the number of the command.
    fn push(&mut self, command: OperatorCommand, by: &Arc<str>) -> Result<u64, SendCommandError> {
        if command.is_urgent() {
            // One of each is enough: a key that is held down does not fill the memory.
            self.waiting.retain(|waiting| waiting.command != command);
        } else if self.waiting.len() >= MAX_WAITING {
            return Err(SendCommandError::Full);
        }
        self.last += 1;
        let number = self.last;
        if command == OperatorCommand::Stop {
            self.latch.latch(number, by);
        }
        self.waiting.push_back(Submitted { number, command });
        self.wake();
        Ok(number)
    }

    /// Ends the Stop `named`, and wakes the control loop. Returns the number of the command.
    fn resume(&mut self, named: u64, by: &Arc<str>) -> Result<u64, SendCommandError> {
        let (number, now) = (self.last + 1, (self.clock)());
        self.latch.resume(named, number, by, now)?;
        self.last = number;
        self.wake();
        Ok(number)
    }

    fn wake(&self) {
        if let Some(waker) = &self.waker {
            waker.wake_by_ref();
        }
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

    /// Returns whether a Stop is in force, or waits.
    pub(crate) fn is_stopped(&self) -> bool {
        let queue = lock(&self.queue);
        let waits = || queue.waiting.iter().any(|it| it.command == OperatorCommand::Stop);
        queue.latch.stop().is_some() || waits()
    }

    /// Removes and returns the events of Stops since the last call, in their order.
    pub(crate) fn take_stop_events(&self) -> VecDeque<StopEvent> {
        lock(&self.queue).latch.take_events()
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

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering::Relaxed;
    use std::time::Duration;

    use super::*;

    fn commands(submitted: &[Submitted]) -> Vec<OperatorCommand> {
        submitted.iter().map(|submitted| submitted.command).collect()
    }

    fn jog() -> OperatorCommand {
        OperatorCommand::Jog { motor: 0, distance: 5.0, rate: 5.0 }
    }

    #[test]
    fn nothing_moves_the_ball_from_a_stop_to_the_resume_that_names_it() {
        use OperatorCommand::{ClearFault, End, Hold, RampDown, Resume, Stop};
        let (page, receiver) = operator();
        let script = page.source("a script");
        script.send(Hold).unwrap();
        let stop = page.send(Stop).unwrap();
        assert!(receiver.is_stopped());
        let target = OperatorCommand::Target(nalgebra::Point3::new(0.4, 0.3, 0.2));
        assert_eq!(page.send(RampDown), Err(Stopped(stop).into()));
        for command in [Hold, jog(), target] {
            for sender in [&page, &script] {
                assert_eq!(sender.send(command), Err(Stopped(stop).into()), "{command}");
            }
        }
        assert_eq!(page.admit_target(Continuity::Begins), Err(Stopped(stop).into()));
        for command in [ClearFault, Stop, End] {
            script.send(command).unwrap();
        }
        let held = page.stop().unwrap();
        assert_eq!((held.number, &*held.by, held.refused), (stop + 2, "a script", 7));
        let other = ResumeError::OtherStop { holds: stop + 2 };
        assert_eq!(page.send(Resume { stop }), Err(other.into()));
        assert_eq!(page.send(Resume { stop: stop + 2 }), Ok(stop + 4));
        assert_eq!(page.stop(), None);
        // The control loop has not taken the Stop.
        assert!(receiver.is_stopped());
        let events = receiver.take_stop_events();
        assert!(matches!(events[2], StopEvent::Stopped(_)), "{events:?}");
        assert!(matches!(events[3], StopEvent::Resumed { .. }), "{events:?}");
        page.source("another page").send(Hold).unwrap();
    }

    #[test]
    fn a_source_that_goes_on_over_a_resume_must_be_silent_before_it_moves_the_ball() {
        let begin = Instant::now();
        let passed = Arc::new(std::sync::atomic::AtomicU64::new(0));
        let time = Arc::clone(&passed);
        let now = move || begin + Duration::from_millis(time.load(Relaxed));
        let (page, _receiver) = operator_with_clock(Box::new(now));
        let script = page.source("a script");
        script.send(OperatorCommand::Hold).unwrap();
        let stop = page.send(OperatorCommand::Stop).unwrap();
        page.send(OperatorCommand::Resume { stop }).unwrap();
        for _ in 0..50 {
            passed.fetch_add(100, Relaxed);
            let refused = script.send(OperatorCommand::Hold);
            assert_eq!(refused, Err(SendCommandError::MustBeginAnew));
        }
        assert!(!script.is_silent());
        passed.fetch_add(1001, Relaxed);
        assert!(script.is_silent());
        script.send(OperatorCommand::Hold).unwrap();
        script.admit_target(Continuity::MayGoOn).unwrap();
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
