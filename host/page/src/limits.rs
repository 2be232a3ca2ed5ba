//! Limits of the server: what clients may use of it.

use std::time::{Duration, Instant};

/// Limits of the page's server.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Highest number of connections, all kinds. One more ends the oldest that has sent no whole
    /// request, or is refused.
    pub connections: usize,
    /// Highest number of open pages.
    pub clients: usize,
    /// Longest head of a request, bytes.
    pub request_bytes: usize,
    /// Longest time for a request to arrive, and for its reply to be taken.
    pub request_time: Duration,
    /// Longest message of a client, bytes.
    pub message_bytes: usize,
    /// Rate of a client's messages, messages/s.
    pub messages: Rate,
    /// Rate of a client's bytes, bytes/s.
    pub bytes: Rate,
    /// Longest time in which a client acknowledges nothing. After it the connection is closed.
    pub silence: Duration,
    /// Longest time in which a client leaves an update unacknowledged and still counts as present.
    /// After it a jog that it began is stopped.
    pub absence: Duration,
    /// Rate of updates with pictures to each client, updates/s.
    pub updates: Rate,
}

impl Limits {
    /// Limits of the program. A page sends 30 acknowledgements of 30 bytes a second and the
    /// commands of a person.
    pub const DEFAULT: Self = Self {
        connections: 32,
        clients: 8,
        request_bytes: 8192,
        request_time: Duration::from_secs(5),
        message_bytes: 1024,
        messages: Rate { per_second: 100.0, burst: 200.0 },
        bytes: Rate { per_second: 32_768.0, burst: 65_536.0 },
        silence: Duration::from_secs(10),
        absence: Duration::from_secs(1),
        updates: Rate { per_second: 30.0, burst: 2.0 },
    };
}

/// Highest rate of something, with a reserve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// Mean rate, 1/s.
    pub per_second: f64,
    /// Number that may come at once.
    pub burst: f64,
}

/// Token bucket: counts something against its [`Rate`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bucket {
    rate: Rate,
    /// Number that may come now.
    level: f64,
    updated: Instant,
}

impl Bucket {
    pub(crate) fn new(rate: Rate, now: Instant) -> Self {
        Self { rate, level: rate.burst, updated: now }
    }

    /// Takes `amount` at `now`. Returns whether the rate allows it; if not, nothing is taken.
    pub(crate) fn take(&mut self, amount: f64, now: Instant) -> bool {
        self.refill(now);
        let allowed = self.level >= amount;
        if allowed {
            self.level -= amount;
        }
        allowed
    }

    /// Returns the time until 1 is allowed.
    pub(crate) fn wait(&mut self, now: Instant) -> Duration {
        self.refill(now);
        Duration::from_secs_f64((1.0 - self.level).max(0.0) / self.rate.per_second)
    }

    fn refill(&mut self, now: Instant) {
        let gained = now.saturating_duration_since(self.updated).as_secs_f64();
        self.level = (self.level + gained * self.rate.per_second).min(self.rate.burst);
        self.updated = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bucket_allows_its_burst_and_then_its_rate() {
        let begin = Instant::now();
        let mut bucket = Bucket::new(Rate { per_second: 10.0, burst: 2.0 }, begin);
        assert!(bucket.take(1.0, begin) && bucket.take(1.0, begin));
        assert!(!bucket.take(1.0, begin));
        assert_eq!(bucket.wait(begin), Duration::from_millis(100));
        assert!(bucket.take(1.0, begin + Duration::from_millis(101)));
        assert!(!bucket.take(1.0, begin + Duration::from_millis(110)));
        assert_eq!(bucket.wait(begin + Duration::from_secs(60)), Duration::ZERO);
        assert!(!bucket.take(3.0, begin + Duration::from_secs(60)), "no more than the burst");
    }
}
