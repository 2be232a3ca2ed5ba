//! Motions that have to come to an end: a jog, and a ramp down to rest.

use std::time::Duration;

/// Jog that the board has accepted.
#[derive(Debug, Clone, Copy)]
pub(super) struct JogUnderWay {
    pub(super) begin: Duration,
    pub(super) longest: Duration,
}

/// Motors that ramp down after a stop.
#[derive(Debug)]
pub(super) struct RampDown {
    pub(super) begin: Duration,
    /// Longest time of the ramp; known from the first rates on.
    pub(super) longest: Option<Duration>,
    /// Least sum of the rates so far, 1/256 full steps/s.
    pub(super) slowest: u64,
    /// Time of that sum.
    pub(super) since: Duration,
}

impl RampDown {
    /// Begins at the time `now` of the stop.
    pub(super) fn begin(now: Duration) -> Self {
        Self { begin: now, longest: None, slowest: u64::MAX, since: now }
    }
}
