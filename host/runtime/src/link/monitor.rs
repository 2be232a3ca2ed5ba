//! Whether the board at the other end is there, keeps up, and is still the one that was configured.

use std::collections::VecDeque;
use std::time::Duration;

/// Longest age of telemetry, and of a position that the board has not acknowledged, where the board
/// is not configured to wait longer for the host.
const MAX_AGE: Duration = Duration::from_secs(1);

/// Age of telemetry above which a missing acknowledgement is put down to a silent board: five times
/// the longest interval of telemetry.
const QUIET: Duration = Duration::from_millis(500);

/// A position on its way, or lost.
#[derive(Debug, Clone, Copy)]
struct Sent {
    sequence: u16,
    id: u16,
    at: Duration,
}

/// What is wrong with the board or its link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Problem {
    /// No telemetry for this long: above the longest age, or above [`QUIET`] with a position
    /// unacknowledged for the longest age.
    Silent(Duration),
    /// A position was sent so long ago, and neither it nor a later one was acknowledged.
    Lagging(Duration),
    /// The board does not know this host any more.
    Restarted,
}

/// State of the link, from the times of positions and telemetry.
#[derive(Debug)]
pub(super) struct LinkMonitor {
    /// Longest age of telemetry, and of a position that the board has not acknowledged.
    max_age: Duration,
    /// When telemetry came last, or the session began.
    last_rx: Duration,
    /// Positions that were not acknowledged yet, oldest first: those of `max_age` at most, since
    /// the run ends then.
    sent: VecDeque<Sent>,
    restarted: bool,
}

impl Default for LinkMonitor {
    fn default() -> Self {
        let (last_rx, sent) = (Duration::ZERO, VecDeque::new());
        Self { max_age: MAX_AGE, last_rx, sent, restarted: false }
    }
}

impl LinkMonitor {
    /// Begins to watch at `now`: the board has just answered.
    pub(super) fn begin(&mut self, now: Duration) {
        *self = Self { last_rx: now, ..Self::default() };
    }

    /// Begins to watch a board at `now` that stops where the host is silent for `deadline`. The
    /// host waits as long for the board.
    pub(super) fn begin_configured(&mut self, now: Duration, deadline: Duration) {
        self.begin(now);
        self.max_age = deadline.max(MAX_AGE);
    }

    /// Notes that a position was sent.
    pub(super) fn sent(&mut self, sequence: u16, id: u16, at: Duration) {
        self.sent.push_back(Sent { sequence, id, at });
    }

    /// Notes telemetry that came at `now`, and acknowledges the position of this number and those
    /// before it.
    pub(super) fn acknowledged(&mut self, sequence: Option<u16>, now: Duration) {
        self.last_rx = now;
        let Some(last) = sequence else { return };
        // Numbers wrap.
        self.sent.retain(|sent| (sent.sequence.wrapping_sub(last) as i16) > 0);
    }

    /// Notes that the board refused the command `id`; whether that was a position on its way.
    pub(super) fn refused(&mut self, id: u16) -> bool {
        let Some(at) = self.sent.iter().position(|sent| sent.id == id) else { return false };
        // Those before it were lost, or refused too.
        self.sent.drain(..=at);
        true
    }

    /// Notes that the board has lost this session.
    pub(super) fn forgotten(&mut self) {
        self.restarted = true;
    }

    /// Returns what is wrong at `now`, the worst first.
    pub(super) fn problem(&self, now: Duration) -> Option<Problem> {
        let age = now.saturating_sub(self.last_rx);
        let oldest = self.sent.front().map_or(Duration::ZERO, |sent| now.saturating_sub(sent.at));
        if self.restarted {
            Some(Problem::Restarted)
        } else if age > self.max_age || (oldest > self.max_age && age > QUIET) {
            // A position may have been on its way when the last telemetry came.
            Some(Problem::Silent(age))
        } else if oldest > self.max_age {
            Some(Problem::Lagging(oldest))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn positions_are_acknowledged_by_later_ones_also_over_the_wrap() {
        let mut monitor = LinkMonitor::default();
        monitor.begin(ms(0));
        for (k, sequence) in [65_534u16, 65_535, 0, 1].into_iter().enumerate() {
            monitor.sent(sequence, 10 + k as u16, ms(k as u64));
        }
        monitor.acknowledged(Some(0), ms(900));
        assert_eq!(monitor.problem(ms(1003)), None);
        assert_eq!(monitor.problem(ms(1004)), Some(Problem::Lagging(ms(1001))));
        monitor.acknowledged(Some(1), ms(1100));
        assert_eq!(monitor.problem(ms(2100)), None);
        assert_eq!(monitor.problem(ms(2101)), Some(Problem::Silent(ms(1001))));
    }

    /// The position was on its way when the last telemetry came.
    #[test]
    fn a_silent_board_is_not_reported_as_a_slow_link() {
        let mut monitor = LinkMonitor::default();
        monitor.begin(ms(0));
        monitor.sent(1, 7, ms(0));
        monitor.acknowledged(None, ms(20));
        assert_eq!(monitor.problem(ms(1000)), None);
        assert_eq!(monitor.problem(ms(1001)), Some(Problem::Silent(ms(981))));
        // A board whose telemetry arrives is not silent.
        monitor.acknowledged(None, ms(900));
        assert_eq!(monitor.problem(ms(1001)), Some(Problem::Lagging(ms(1001))));
    }

    #[test]
    fn the_host_waits_for_the_board_as_long_as_the_board_for_the_host() {
        let problems = |deadline: u64| {
            let mut monitor = LinkMonitor::default();
            monitor.begin_configured(ms(0), ms(deadline));
            monitor.sent(1, 7, ms(0));
            monitor.acknowledged(None, ms(4900));
            [4900, 5000, 5001].map(|now| monitor.problem(ms(now)))
        };
        assert_eq!(problems(5000), [None, None, Some(Problem::Lagging(ms(5001)))]);
        // A second at least.
        assert_eq!(problems(300), [4900, 5000, 5001].map(|age| Some(Problem::Lagging(ms(age)))));
    }

    #[test]
    fn a_refused_position_is_acknowledged_too() {
        let mut monitor = LinkMonitor::default();
        monitor.begin(ms(0));
        monitor.sent(1, 7, ms(0));
        monitor.sent(2, 8, ms(0));
        assert!(!monitor.refused(6));
        assert!(monitor.refused(8));
        assert_eq!(monitor.problem(ms(1000)), None);
        monitor.forgotten();
        assert_eq!(monitor.problem(ms(1)), Some(Problem::Restarted));
    }
}
