//! Wall clock of the messages that leave a run.

use std::time::{SystemTime, UNIX_EPOCH};

const NANOSECONDS: f64 = 1e9;

/// Clock of messages: the run's time, mapped once to the wall clock, so that a wall clock that is
/// set during the run tears no gap.
#[derive(Debug, Default)]
pub struct RunClock {
    /// Wall clock at the run's start, nanoseconds since 1970; `None` before the first stamp.
    start: Option<u64>,
}

impl RunClock {
    /// Returns the stamp of `time`, seconds since the run's start, in nanoseconds since 1970. The
    /// first call sets the start.
    pub fn stamp(&mut self, time: f64) -> u64 {
        let run = (time.max(0.0) * NANOSECONDS).round() as u64;
        let start = *self.start.get_or_insert_with(|| now().saturating_sub(run));
        start.saturating_add(run)
    }
}

/// Returns the wall clock, nanoseconds since 1970.
pub fn now() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_differ_as_the_times_of_the_run_do() {
        let mut clock = RunClock::default();
        let before = now();
        let first = clock.stamp(2.5);
        assert!((before..=now()).contains(&first), "{first}");
        assert_eq!(clock.stamp(2.533_333) - first, 33_333_000);
        assert_eq!(first - clock.stamp(0.0), 2_500_000_000);
    }
}
