//! Clock of a live source.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

/// Clock of a live source: seconds since its start, in real time; 0 before. Clones show the same
/// time in every thread.
#[derive(Debug, Clone, Default)]
pub struct LiveClock(Arc<OnceLock<Instant>>);

impl LiveClock {
    /// Returns a clock that started at `start`.
    pub fn since(start: Instant) -> Self {
        Self(Arc::new(OnceLock::from(start)))
    }

    /// Starts the clock if it stands. Returns the time of its start.
    pub fn start(&self) -> Instant {
        *self.0.get_or_init(Instant::now)
    }

    /// Returns the seconds since the start; 0 before it.
    pub fn now(&self) -> f64 {
        self.0.get().map_or(0.0, |start| start.elapsed().as_secs_f64())
    }
}
