//! The Stop in force a rig until a Resume names it, and the rule for a source of commands after
//! the Resume.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use thiserror::Error;

/// Number of events that wait for the control loop. Of more the oldest are dropped.
const MAX_EVENTS: usize = 64;

/// A Stop in force: nothing moves the ball before a [`Resume`](super::OperatorCommand::Resume)
/// with its number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stop {
    /// Number of the command.
    pub number: u64,
    /// Name of its sender, for people.
    pub by: Arc<str>,
    /// Wall clock when it was sent.
    pub since: SystemTime,
    /// Number of commands and targets that were refused since then.
    pub refused: u64,
}

/// Event of the Stop in force. Its text is for people.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum StopEvent {
    /// A Stop is in force from now on. The board has been asked to ramp the motors down.
    #[error("stopped by {} (command {}): nothing moves the ball before a Resume", .0.by, .0.number)]
    Stopped(Stop),
    /// Something that moves the ball was refused. There is one such event for each Stop.
    #[error(
        "{by}: {what} is refused, for the rig is stopped (command {number}): Resume first; further \
         refusals are counted only"
    )]
    Refused {
        /// Number of the Stop.
        number: u64,
        /// Name of the sender.
        by: Arc<str>,
        /// The command.
        what: String,
    },
    /// A Resume has ended the Stop. The ball stays where it is.
    #[error("resumed by {by} (command {}; refused meanwhile: {})", .stop.number, .stop.refused)]
    Resumed {
        /// Number of the Resume.
        number: u64,
        /// The Stop.
        stop: Stop,
        /// Name of the sender of the Resume.
        by: Arc<str>,
    },
}

impl StopEvent {
    /// Returns the number of the Stop that the event is about.
    pub(crate) fn stop(&self) -> u64 {
        match self {
            Self::Stopped(stop) | Self::Resumed { stop, .. } => stop.number,
            Self::Refused { number, .. } => *number,
        }
    }
}

/// Refusal for a Stop in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("the rig is stopped (command {0}): Resume first")]
pub struct Stopped(pub u64);

/// Reason why a Resume ends nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum ResumeError {
    /// It names another Stop than the one in force.
    #[error("another Stop is in force: that of command {holds}")]
    OtherStop {
        /// Number of the Stop in force.
        holds: u64,
    },
    /// No Stop is in force.
    #[error("the rig is not stopped")]
    NotStopped,
}

/// The Stop in force, if there is one, and the last Resume. It is apart from the state of the
/// board: a fault and its clearing leave it.
#[derive(Debug, Default)]
pub(super) struct StopLatch {
    stop: Option<Stop>,
    /// Number of Resumes so far.
    resumes: u64,
    /// Time of the last Resume.
    resumed: Option<Instant>,
    /// Events that the control loop has not taken.
    events: VecDeque<StopEvent>,
}

impl StopLatch {
    /// Returns the Stop in force.
    pub(super) fn stop(&self) -> Option<&Stop> {
        self.stop.as_ref()
    }

    /// Returns the number of Resumes so far.
    pub(super) fn resumes(&self) -> u64 {
        self.resumes
    }

    /// Returns the time of the last Resume.
    pub(super) fn resumed(&self) -> Option<Instant> {
        self.resumed
    }

    /// Notes a Stop, which is in force from now on. A Stop before it is replaced: a Resume must
    /// name the newest one.
    pub(super) fn latch(&mut self, number: u64, by: &Arc<str>) {
        let (by, since) = (Arc::clone(by), SystemTime::now());
        let refused = self.stop.as_ref().map_or(0, |stop| stop.refused);
        let stop = Stop { number, by, since, refused };
        self.note(StopEvent::Stopped(stop.clone()));
        self.stop = Some(stop);
    }

    /// Checks that no Stop is in force. Counts what is refused for it.
    ///
    /// # Errors
    /// [`Stopped`] with the number of the Stop in force.
    pub(super) fn admit(&mut self, by: &Arc<str>, what: &dyn ToString) -> Result<(), Stopped> {
        let Some(stop) = &mut self.stop else { return Ok(()) };
        let number = stop.number;
        stop.refused += 1;
        if stop.refused == 1 {
            let (by, what) = (Arc::clone(by), what.to_string());
            self.note(StopEvent::Refused { number, by, what });
        }
        Err(Stopped(number))
    }

    /// Ends the Stop `named`, at `now`, by the Resume `number` of `by`.
    ///
    /// # Errors
    /// Where no Stop is in force, or another one.
    pub(super) fn resume(
        &mut self,
        named: u64,
        number: u64,
        by: &Arc<str>,
        now: Instant,
    ) -> Result<(), ResumeError> {
        let holds = self.stop.as_ref().map(|stop| stop.number);
        let Some(stop) = self.stop.take_if(|stop| stop.number == named) else {
            let other = |holds| ResumeError::OtherStop { holds };
            return Err(holds.map_or(ResumeError::NotStopped, other));
        };
        self.resumes += 1;
        self.resumed = Some(now);
        self.note(StopEvent::Resumed { number, stop, by: Arc::clone(by) });
        Ok(())
    }

    /// Removes and returns the events since the last call, in their order.
    pub(super) fn take_events(&mut self) -> VecDeque<StopEvent> {
        std::mem::take(&mut self.events)
    }

    fn note(&mut self, event: StopEvent) {
        if self.events.len() >= MAX_EVENTS {
            self.events.pop_front();
        }
        self.events.push_back(event);
    }
}

/// Silence after which a source begins anew.
pub const BEGINS_ANEW_AFTER: Duration = Duration::from_secs(1);

/// Relation of a command or target to those before it of the same source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Continuity {
    /// A new gesture begins with it.
    Begins,
    /// It may belong to what the source has sent before.
    MayGoOn,
}

/// Turn of a source: a page, a publisher or a program that moves the ball. A source that was
/// sending when a Resume came does not move the ball by itself: it begins anew with a gesture, or
/// after [`BEGINS_ANEW_AFTER`] without a command. A new connection is a new source.
#[derive(Debug, Default)]
pub(super) struct Turn {
    /// Number of Resumes when the source last moved the ball.
    resumes: u64,
    /// Time of the last command, also of one that was refused.
    last: Option<Instant>,
    /// Time of the last gesture that was refused: one that is repeated is not new.
    refused_gesture: Option<Instant>,
}

impl Turn {
    /// Notes a command at `now` that is refused because the rig is stopped.
    pub(super) fn note_refused(&mut self, continuity: Continuity, now: Instant) {
        self.last = Some(now);
        if continuity == Continuity::Begins {
            self.refused_gesture = Some(now);
        }
    }

    /// Returns whether the source may move the ball with a command at `now`, after `resumes`
    /// Resumes.
    pub(super) fn takes(&mut self, continuity: Continuity, resumes: u64, now: Instant) -> bool {
        let may_move = self.resumes == resumes || self.begins_anew(continuity, now);
        if may_move {
            (self.resumes, self.last) = (resumes, Some(now));
        } else {
            self.note_refused(continuity, now);
        }
        may_move
    }

    fn begins_anew(&self, continuity: Continuity, now: Instant) -> bool {
        let since = match continuity {
            Continuity::Begins => self.refused_gesture,
            Continuity::MayGoOn => self.last,
        };
        is_silent(since, now)
    }

    /// Returns whether the source has sent nothing for [`BEGINS_ANEW_AFTER`].
    pub(super) fn is_silent(&self, now: Instant) -> bool {
        is_silent(self.last, now)
    }
}

fn is_silent(last: Option<Instant>, now: Instant) -> bool {
    last.is_none_or(|last| now.saturating_duration_since(last) > BEGINS_ANEW_AFTER)
}

#[cfg(test)]
mod tests {
    use super::*;
    use Continuity::{Begins, MayGoOn};

    #[test]
    fn only_a_resume_that_names_the_newest_stop_ends_it() {
        let (mut latch, page, now) = (StopLatch::default(), Arc::from("the page"), Instant::now());
        let resume = |latch: &mut StopLatch, named| latch.resume(named, 9, &page, now);
        assert_eq!(resume(&mut latch, 1), Err(ResumeError::NotStopped));
        latch.latch(1, &page);
        latch.latch(4, &page);
        assert_eq!(resume(&mut latch, 1), Err(ResumeError::OtherStop { holds: 4 }));
        assert_eq!(resume(&mut latch, 4), Ok(()));
        assert_eq!((latch.stop(), latch.resumes(), latch.resumed()), (None, 1, Some(now)));
        assert_eq!(resume(&mut latch, 4), Err(ResumeError::NotStopped));
    }

    #[test]
    fn refusals_are_counted_and_the_first_is_an_event() {
        let mut latch = StopLatch::default();
        let [page, script] = ["page 1", "a script"].map(Arc::from);
        assert_eq!(latch.admit(&script, &"hold"), Ok(()));
        latch.latch(7, &page);
        for _ in 0..1000 {
            assert_eq!(latch.admit(&script, &"hold"), Err(Stopped(7)));
        }
        let events: Vec<_> = latch.take_events().iter().map(ToString::to_string).collect();
        assert_eq!(events.len(), 2, "{events:?}");
        assert!(events[0].starts_with("stopped by page 1 (command 7)"), "{events:?}");
        assert!(events[1].starts_with("a script: hold is refused, for the rig is"), "{events:?}");
        // A second Stop does not begin to count anew.
        latch.latch(8, &page);
        let _refused = latch.admit(&script, &"hold");
        assert_eq!((latch.take_events().len(), latch.stop().unwrap().refused), (1, 1001));
        (0..1000).for_each(|number| latch.latch(number, &page));
        assert_eq!(latch.take_events().len(), MAX_EVENTS);
    }

    struct Bench {
        turn: Turn,
        begin: Instant,
    }

    impl Bench {
        fn new() -> Self {
            Self { turn: Turn::default(), begin: Instant::now() }
        }

        fn at(&self, milliseconds: u64) -> Instant {
            self.begin + Duration::from_millis(milliseconds)
        }

        fn takes(&mut self, continuity: Continuity, resumes: u64, milliseconds: u64) -> bool {
            let now = self.at(milliseconds);
            self.turn.takes(continuity, resumes, now)
        }
    }

    #[test]
    fn a_source_that_goes_on_over_a_resume_must_be_silent_first() {
        let mut bench = Bench::new();
        assert!(bench.takes(MayGoOn, 0, 0));
        // A Stop and a Resume between two of its commands.
        for k in 1..40 {
            assert!(!bench.takes(MayGoOn, 1, 100 * k));
        }
        assert!(bench.takes(MayGoOn, 1, 3900 + 1001));
        assert!(bench.takes(MayGoOn, 1, 3900 + 1002));
    }

    #[test]
    fn a_new_gesture_and_a_new_source_begin_at_once() {
        let mut bench = Bench::new();
        assert!(bench.takes(Begins, 0, 0));
        assert!(!bench.takes(MayGoOn, 1, 30));
        assert!(bench.takes(Begins, 1, 60));
        assert!(bench.takes(MayGoOn, 1, 90));
        assert!(Bench::new().takes(MayGoOn, 5, 0));
    }

    #[test]
    fn a_gesture_that_is_repeated_is_not_new() {
        let mut bench = Bench::new();
        let now = bench.at(0);
        bench.turn.note_refused(Begins, now);
        for k in 1..10 {
            assert!(!bench.takes(Begins, 1, 100 * k));
        }
        assert!(bench.takes(Begins, 1, 2000));
    }
}
