//! The pace of a simulation: its time beside the computer's.

use std::thread;
use std::time::{Duration, Instant};

/// Largest lag behind real time of a simulation that waits for its parts: it is made up for as soon
/// as they are quick again.
pub(super) const LED_LAG_MAX: Duration = Duration::from_millis(100);

/// Keeps the time of a simulation at a multiple of the computer's. Where the computer is late by
/// more than a limit, the simulation goes slower, and nothing in it is late.
#[derive(Debug)]
pub struct Pace {
    /// Seconds of the simulation in a second of the computer.
    speed: f64,
    last: Instant,
    /// Time of the computer that has passed, and not yet in the simulation.
    due: Duration,
}

impl Pace {
    /// Begins now, at `speed` seconds of the simulation in a second of the computer.
    pub fn begin(speed: f64) -> Self {
        Self { speed, last: Instant::now(), due: Duration::ZERO }
    }

    /// Returns the time of the simulation that is due now: at most that of `limit`, a time of the
    /// computer.
    pub fn due(&mut self, limit: Duration) -> Duration {
        let now = Instant::now();
        self.due = (self.due + (now - self.last)).min(limit);
        self.last = now;
        self.due.mul_f64(self.speed)
    }

    /// Notes that this time of the simulation has passed.
    pub fn pass(&mut self, time: Duration) {
        self.due = self.due.saturating_sub(time.div_f64(self.speed));
    }

    /// Waits until `time` of the simulation is due, and notes that it has passed.
    pub fn wait(&mut self, time: Duration) {
        let missing = time.saturating_sub(self.due(LED_LAG_MAX));
        thread::sleep(missing.div_f64(self.speed));
        self.due(LED_LAG_MAX);
        self.pass(time);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_computer_makes_the_simulation_slower() {
        let (second, limit) = (Duration::from_secs(1), Duration::from_millis(100));
        let mut pace = Pace { last: Instant::now() - second, ..Pace::begin(4.0) };
        assert_eq!(pace.due(limit), 4 * limit);
        pace.pass(3 * limit);
        pace.last = Instant::now() + second;
        assert_eq!(pace.due(limit), limit);
        pace.pass(second);
        pace.last = Instant::now() + second;
        assert_eq!(pace.due(limit), Duration::ZERO);
    }
}
