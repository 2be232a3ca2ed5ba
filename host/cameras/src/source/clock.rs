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

/// Clock that stamps the frames of a device or of a device's recording.
#[derive(Debug, Clone)]
pub(super) enum DeviceClock {
    /// The host's, since the device was opened.
    Host(LiveClock),
    /// The recording's: time stamp of its last frame, seconds.
    Recording(f64),
}

impl DeviceClock {
    /// Returns the clock of a device that was opened at `start`.
    pub(super) fn since(start: Instant) -> Self {
        Self::Host(LiveClock::since(start))
    }

    /// Returns the clock of a recording, which begins at 0.
    pub(super) fn recording() -> Self {
        Self::Recording(0.0)
    }

    /// Sets the clock of a recording to the time stamp of a frame, seconds.
    pub(super) fn follow(&mut self, stamp: f64) {
        if let Self::Recording(now) = self {
            *now = stamp;
        }
    }

    /// Returns the present time, seconds.
    pub(super) fn now(&self) -> f64 {
        match self {
            Self::Host(clock) => clock.now(),
            Self::Recording(now) => *now,
        }
    }

    /// Returns the clock of a live device; `None` for a recording.
    pub(super) fn live(&self) -> Option<&LiveClock> {
        match self {
            Self::Host(clock) => Some(clock),
            Self::Recording(_) => None,
        }
    }
}
