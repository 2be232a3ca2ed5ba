//! What stops the board by itself as time passes.

use plumb_protocol::message::Fault;
use plumb_protocol::units::{Micros, Milliseconds};

use super::{Activity, Board};

/// Whether `span_us` is longer than `limit`.
fn exceeds(span_us: u64, limit: Milliseconds) -> bool {
    // 16 + 10 bits: a product of 32 costs the chip a clock, one of 64 forty.
    span_us > u64::from(u32::from(limit.0) * 1000)
}

impl Board {
    /// The deadline that has passed, if any.
    pub(super) fn expired(&self, now: Micros) -> Option<Fault> {
        let deadlines = self.params?.deadlines;
        let under_way = match &self.activity {
            Activity::Idle | Activity::Faulted(_) => return None,
            Activity::Jogging(_) => None,
            Activity::Seeking(_) => self.unseen_us(now),
        };
        if exceeds(now.since(self.heard), deadlines.host) {
            return Some(Fault::HostSilent);
        }
        under_way.filter(|&span| exceeds(span, deadlines.position)).map(|_| Fault::PositionLost)
    }

    /// Whether positions have failed to come for so long that the rates are cut: two fifths of the deadline, which
    /// at 500 ms and 30 Hz is six pictures.
    pub(super) fn coasting(&self, now: Micros) -> bool {
        let (Some(params), Some(span)) = (&self.params, self.unseen_us(now)) else {
            return false;
        };
        span > u64::from(u32::from(params.deadlines.position.0) * 400)
    }

    /// How long the ball was not seen, or the target is waiting for its first position, µs; `None` without a target.
    fn unseen_us(&self, now: Micros) -> Option<u64> {
        let Activity::Seeking(seek) = &self.activity else {
            return None;
        };
        Some(now.since(self.sight.captured.map_or(seek.since, |captured| captured.max(seek.since))))
    }
}
