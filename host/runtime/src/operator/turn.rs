//! When a source of commands may move the ball again after a Resume.

use std::time::{Duration, Instant};

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
