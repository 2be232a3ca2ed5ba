//! Time stamps of the messages.

use std::time::{SystemTime, UNIX_EPOCH};

use foxglove::messages::Timestamp;

const NANOSECONDS: u64 = 1_000_000_000;

/// Clock of the messages: the run's time, mapped once to the wall clock, so that a wall clock that
/// is set during the run tears no gap.
#[derive(Debug, Default)]
pub(crate) struct Clock {
    /// Wall clock at the run's start, nanoseconds since 1970; `None` before the first stamp.
    start: Option<u64>,
}

impl Clock {
    /// Returns the stamp of `time`, seconds since the run's start, in nanoseconds since 1970. The
    /// first call sets the start.
    pub(crate) fn stamp(&mut self, time: f64) -> u64 {
        let run = (time.max(0.0) * NANOSECONDS as f64).round() as u64;
        let start = *self.start.get_or_insert_with(|| wall_clock().saturating_sub(run));
        start.saturating_add(run)
    }
}

/// Returns the wall clock, nanoseconds since 1970.
fn wall_clock() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

/// Converts a stamp for a message of Foxglove's.
pub(crate) fn timestamp(stamp: u64) -> Option<Timestamp> {
    let seconds = u32::try_from(stamp / NANOSECONDS).ok()?;
    Timestamp::new_checked(seconds, (stamp % NANOSECONDS) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_differ_as_the_times_of_the_run_do() {
        let mut clock = Clock::default();
        let before = wall_clock();
        let first = clock.stamp(2.5);
        assert!((before..=wall_clock()).contains(&first), "{first}");
        assert_eq!(clock.stamp(2.533_333) - first, 33_333_000);
        assert_eq!(first - clock.stamp(0.0), 2_500_000_000);
    }

    #[test]
    fn a_stamp_keeps_its_nanoseconds() {
        let stamp = timestamp(1_800_000_000_123_456_789).unwrap();
        assert_eq!((stamp.sec(), stamp.nsec()), (1_800_000_000, 123_456_789));
        assert_eq!(timestamp(u64::MAX), None);
    }
}
