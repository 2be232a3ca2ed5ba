//! Whether the board at the other end is there, keeps up, and is still the one that was configured.

use std::collections::VecDeque;
use std::time::Duration;

use plumb_protocol::units::Micros;

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

/// Largest lag of the board's clock behind the host's that counts as the same start: the jitter of
/// the link. A board has run for longer before a host has configured it.
const TOLERANCE: Duration = Duration::from_millis(200);

/// Time on the board's clock, and when it came, on the host's.
#[derive(Debug, Clone, Copy)]
struct Sample {
    board: Duration,
    host: Duration,
}

/// Clock of the board, from the times in its messages.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BoardClock {
    /// Newest time of a board that had this host's configuration.
    configured: Option<Sample>,
    /// Newest time of any message.
    newest: Option<Sample>,
}

impl BoardClock {
    /// Takes in the time of a message that came at `host`; `is_configured` is whether the board had
    /// this host's configuration.
    pub(super) fn update(&mut self, board: Micros, host: Duration, is_configured: bool) {
        let sample = Some(Sample { board: Duration::from_micros(board.0), host });
        self.newest = sample;
        if is_configured {
            self.configured = sample;
        }
    }

    /// Returns whether the board has ever had this host's configuration.
    pub(super) fn was_configured(&self) -> bool {
        self.configured.is_some()
    }

    /// Returns whether the clock has gone on since the board last had this host's configuration. A
    /// board on a chip begins at 0 when it restarts, an emulated one goes on.
    pub(super) fn has_gone_on(&self) -> bool {
        let (Some(configured), Some(newest)) = (self.configured, self.newest) else { return false };
        let expected = configured.board + newest.host.saturating_sub(configured.host);
        newest.board + TOLERANCE >= expected
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

    /// Returns whether the clock has gone on from 5 s to `board_ms` in 400 ms of the host's time.
    fn has_gone_on(board_ms: u64) -> bool {
        let mut clock = BoardClock::default();
        clock.update(Micros(5_000_000), Duration::from_millis(100), true);
        clock.update(Micros(board_ms * 1000), Duration::from_millis(500), false);
        clock.has_gone_on()
    }

    #[test]
    fn a_clock_that_begins_anew_is_that_of_a_restarted_board() {
        assert!(has_gone_on(5_400) && has_gone_on(5_200) && has_gone_on(6_000));
        assert!(!has_gone_on(5_199) && !has_gone_on(0) && !has_gone_on(400));
        assert!(!BoardClock::default().has_gone_on());
    }
}
