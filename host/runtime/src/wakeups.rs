//! Late wake-ups: an overloaded computer lets this program sleep longer than it asks.

use std::fmt;
use std::thread;
use std::time::{Duration, Instant};

use serde::Serialize;

/// Late wake-ups of a run: times without a message to the board above [`LATE`](crate::link::LATE).
/// The text is for people.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct LateWakeups {
    /// Their number.
    pub times: u64,
    /// Longest time without a message to the board, seconds.
    pub longest_s: f64,
}

impl LateWakeups {
    /// Adds a late wake-up after a time without a message.
    pub(crate) fn add(&mut self, silence: Duration) {
        self.times += 1;
        self.longest_s = self.longest_s.max(silence.as_secs_f64());
    }
}

impl fmt::Display for LateWakeups {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let longest_s = self.longest_s;
        let times = times(self.times);
        write!(
            f,
            "this computer is overloaded: the program woke late {times}, and was silent for \
             {longest_s:.1} s at most. Check what else uses its processor or disk, and whether it \
             sleeps."
        )
    }
}

/// Returns how often, for a person: "once", "2 times".
pub(crate) fn times(count: u64) -> String {
    if count == 1 { "once".to_owned() } else { format!("{count} times") }
}

/// Sleep of a measurement, which is the longest one of the control loop.
const SLEEP: Duration = Duration::from_millis(20);

/// Number of wake-ups of a measurement: one second.
const WAKEUPS: u32 = 50;

/// Lateness from which a computer is overloaded: a third of the deadline of a usual rig
/// (`deadlines.host = 0.3`) is gone before the work of a picture begins.
const OVERLOADED: Duration = Duration::from_millis(100);

/// Lateness of the wake-ups of this program. The text is for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WakeupCheck {
    /// Number of wake-ups.
    pub count: u32,
    /// Greatest lateness.
    pub latest: Duration,
}

impl WakeupCheck {
    /// Sleeps 50 times for 20 ms and measures how late the program wakes.
    pub fn measure() -> Self {
        Self::of(|| {
            let begin = Instant::now();
            thread::sleep(SLEEP);
            begin.elapsed()
        })
    }

    /// Measures with sleeps that last as long as `sleep` returns.
    fn of(mut sleep: impl FnMut() -> Duration) -> Self {
        let latest = (0..WAKEUPS).map(|_| sleep().saturating_sub(SLEEP)).max();
        Self { count: WAKEUPS, latest: latest.unwrap_or_default() }
    }

    /// Returns whether the computer is overloaded.
    pub fn is_overloaded(&self) -> bool {
        self.latest >= OVERLOADED
    }
}

impl fmt::Display for WakeupCheck {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let latest = self.latest.as_secs_f64() * 1e3;
        let count = self.count;
        if self.is_overloaded() {
            write!(
                f,
                "this computer is overloaded: the program woke {latest:.0} ms late. The board \
                 stops where nothing comes for `deadlines.host`. Check what else uses the \
                 processor or disk before you run the rig."
            )
        } else {
            write!(f, "this computer keeps time: {count} wake-ups, {latest:.1} ms late at most")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the measurement on a computer that is late for every tenth sleep.
    fn measured(lateness_ms: u64) -> WakeupCheck {
        let lateness = Duration::from_millis(lateness_ms);
        let mut sleeps = 0_u32;
        let check = WakeupCheck::of(|| {
            sleeps += 1;
            SLEEP + if sleeps.is_multiple_of(10) { lateness } else { Duration::ZERO }
        });
        assert_eq!((check.latest, check.count, sleeps), (lateness, 50, 50));
        check
    }

    #[test]
    fn a_computer_that_wakes_the_program_late_is_overloaded() {
        let text = measured(3).to_string();
        assert_eq!(text, "this computer keeps time: 50 wake-ups, 3.0 ms late at most");
        assert!(!measured(99).is_overloaded());
        let text = measured(180).to_string();
        assert!(text.starts_with("this computer is overloaded: the program woke 180 ms"), "{text}");
    }
}
