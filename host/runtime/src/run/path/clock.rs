//! The path's time on the host's clock, from the board's telemetry.
//!
//! The board's clock is compared with the host's by the positions: telemetry that names a position
//! is later than the sending of that position. The least such difference is the time that a
//! position takes to the board and through it. The board takes a position for as old as it was at
//! its sending, so that board and host agree about the time of a picture.

use std::collections::VecDeque;

/// Number of reports that are kept: 2 s of telemetry at 30 Hz.
const REPORTS: usize = 60;

/// Decrease of the offset, seconds a second: the clocks of board and host drift.
const DRIFT: f64 = 1e-3;

/// Longest extrapolation beyond the last report, seconds.
const LONGEST_S: f64 = 0.3;

/// Report of the board.
#[derive(Debug, Clone, Copy)]
pub(super) struct Report {
    /// Time on the board's clock, seconds.
    pub(super) board: f64,
    /// The path's time then, seconds.
    pub(super) path: f64,
}

/// Estimate of the path's time.
#[derive(Debug, Clone, Default)]
pub(super) struct PathClock {
    reports: VecDeque<Report>,
    /// The host's clock less the board's, and the board's time of this estimate, seconds.
    offset: Option<(f64, f64)>,
}

impl PathClock {
    /// Takes in a report. It names a position that was sent at `sent`, seconds on the host's clock;
    /// `None` where that is unknown.
    pub(super) fn update(&mut self, report: Report, sent: Option<f64>) {
        if self.reports.back().is_some_and(|last| report.board <= last.board) {
            return;
        }
        if let Some(sent) = sent {
            let least = sent - report.board;
            let before = self.offset.map(|(offset, at)| offset - DRIFT * (report.board - at));
            self.offset = Some((before.map_or(least, |before| before.max(least)), report.board));
        }
        if self.reports.len() == REPORTS {
            self.reports.pop_front();
        }
        self.reports.push_back(report);
    }

    /// Returns the path's time of the last report, seconds.
    pub(super) fn reported(&self) -> Option<f64> {
        self.reports.back().map(|report| report.path)
    }

    /// Returns the path's time at `time` on the host's clock, seconds; `None` before the first
    /// report and far from all of them.
    pub(super) fn at(&self, time: f64) -> Option<f64> {
        let (offset, _) = self.offset?;
        let board = time - offset;
        let last = self.reports.len() - 1;
        let next = self.reports.iter().position(|report| report.board >= board);
        let next = next.unwrap_or(last).max(1);
        let (Some(from), Some(to)) = (self.reports.get(next - 1), self.reports.get(next)) else {
            // One report only.
            return self.reported();
        };
        let pace = (to.path - from.path) / (to.board - from.board);
        let distance = (board - to.board).max(from.board - board);
        (distance <= LONGEST_S).then_some(from.path + pace * (board - from.board))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the clock of a path at half its speed, which began at 10 s on the board's clock and
    /// 3 s on the host's. Its reports name positions that were sent `delay` before.
    fn clock(delay: impl Fn(u32) -> f64) -> PathClock {
        let mut clock = PathClock::default();
        for i in 0..100 {
            let elapsed = 0.033 * f64::from(i);
            let report = Report { board: 10.0 + elapsed, path: 0.5 * elapsed };
            clock.update(report, Some(3.0 + elapsed - delay(i)));
        }
        clock
    }

    #[test]
    fn the_time_of_a_moment_between_reports_is_known() {
        let clock = clock(|_| 0.0);
        for elapsed in [2.0, 2.5, 3.2, 3.4] {
            let found = clock.at(3.0 + elapsed).unwrap();
            assert!((found - 0.5 * elapsed).abs() < 1e-9, "{elapsed}: {found}");
        }
        assert_eq!(clock.at(5.0 + 3.0), None);
    }

    #[test]
    fn the_least_delay_counts() {
        let clock = clock(|i| if i % 7 == 3 { 0.002 } else { 0.030 });
        let found = clock.at(3.0 + 2.5).unwrap();
        assert!((found - 1.25).abs() < 0.002, "{found}");
    }

    #[test]
    fn a_clock_without_reports_knows_nothing() {
        assert_eq!(PathClock::default().at(1.0), None);
        assert_eq!(PathClock::default().reported(), None);
    }
}
