//! Status of targets that move, for the diagnostics.

use std::time::{Duration, Instant};

use crate::message::diagnostic::{KeyValue, Level};
use crate::senders::RECENT;
use crate::status::Report;

/// Time for which the diagnostics report a refusal: those of each second show it.
const SHOWN: Duration = Duration::from_secs(2);

/// Status of targets that move.
#[derive(Debug, Clone, Default)]
pub(crate) struct MovingStatus {
    /// Number of targets that were sent to the run.
    taken: u64,
    last_taken: Option<Instant>,
    /// Number of targets that were refused here.
    refused: u64,
    /// The last refusal, of this node or the run, and its time.
    refusal: Option<(Instant, String)>,
}

impl MovingStatus {
    /// Notes a target that was sent to the run.
    pub(crate) fn note_taken(&mut self, now: Instant) {
        self.taken += 1;
        self.last_taken = Some(now);
    }

    /// Notes a refusal of this node. Returns whether it is news: the diagnostics report no other.
    pub(crate) fn note_refusal(&mut self, message: String, now: Instant) -> bool {
        self.refused += 1;
        self.show(message, now)
    }

    /// Reports a refusal. Returns whether it is news: the diagnostics report no other.
    pub(crate) fn show(&mut self, message: String, now: Instant) -> bool {
        let is_news = self.shown(now).is_none();
        self.refusal = Some((now, message));
        is_news
    }

    /// Returns the refusal to report.
    fn shown(&self, now: Instant) -> Option<&str> {
        let (time, message) = self.refusal.as_ref()?;
        (now.saturating_duration_since(*time) < SHOWN).then_some(message)
    }

    /// Returns the report.
    pub(crate) fn report(&self, now: Instant) -> Report {
        let silence = self.last_taken.map(|last| now.saturating_duration_since(last));
        let (level, message) = match (self.shown(now), silence) {
            (Some(refusal), _) => (Level::Warn, refusal),
            (None, None) => (Level::Ok, "no moving target yet"),
            (None, Some(silence)) if silence > RECENT => {
                (Level::Ok, "no target for a second: the ball goes to where it came to rest")
            }
            (None, Some(_)) => (Level::Ok, "targets come"),
        };
        let values =
            vec![KeyValue::new("taken", self.taken), KeyValue::new("refused", self.refused)];
        Report { level, message: message.to_owned(), values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_says_whether_targets_come_and_why_some_are_refused() {
        let (mut status, begin) = (MovingStatus::default(), Instant::now());
        let at = |milliseconds| begin + Duration::from_millis(milliseconds);
        assert_eq!(status.report(at(0)).message, "no moving target yet");
        status.note_taken(at(0));
        assert_eq!(status.report(at(900)).message, "targets come");
        assert_eq!(
            status.report(at(1100)).message,
            "no target for a second: the ball goes to where it came to rest"
        );
        assert!(status.note_refusal("late".to_owned(), at(1200)));
        assert!(!status.note_refusal("too late".to_owned(), at(1300)));
        status.note_taken(at(1400));
        let report = status.report(at(2000));
        assert_eq!((report.level, report.message.as_str()), (Level::Warn, "too late"));
        assert_eq!(report.values, [KeyValue::new("taken", 2), KeyValue::new("refused", 2)]);
        status.note_taken(at(3200));
        assert_eq!(status.report(at(3400)).level, Level::Ok);
    }
}
