//! What stops the board by itself as time passes.

use plumb_protocol::message::Fault;
use plumb_protocol::units::{Micros, Milliseconds};

use super::{Activity, Board, TELEMETRY_US};
use crate::plan::TICK_US;

/// Whether `span_us` is longer than `limit`.
fn exceeds(span_us: u64, limit: Milliseconds) -> bool {
    span_us > limit_us(limit)
}

/// `limit`, µs.
fn limit_us(limit: Milliseconds) -> u64 {
    // 16 + 10 bits: a product of 32 costs the chip a clock, one of 64 forty.
    u64::from(u32::from(limit.0) * 1000)
}

/// How long the ball may be unseen before the rates are cut, µs: two fifths of the deadline, which at 500 ms and 30 Hz is
/// six pictures.
fn coasting_us(deadline: Milliseconds) -> u64 {
    u64::from(u32::from(deadline.0) * 400)
}

impl Board {
    /// The deadline that has passed, if any.
    pub(super) fn expired(&self, now: Micros) -> Option<Fault> {
        let deadlines = self.params.as_ref()?.deadlines;
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

    /// Since when positions have failed to come for so long that the rates are cut, if they have.
    pub(super) fn coasting(&self, now: Micros) -> Option<Micros> {
        let since = self.unseen_since()?.0 + coasting_us(self.params.as_ref()?.deadlines.position);
        (now.0 > since).then_some(Micros(since))
    }

    /// How many ticks after that at `now` there are until one in which the passing of time brings something, as things are: a
    /// deadline, or telemetry. What happens meanwhile may put it off, but brings nothing sooner without being looked at itself.
    #[inline(never)]
    pub(super) fn idle_ticks(&self, now: Micros) -> u32 {
        if self.bootloader || self.storing.is_some() || matches!(self.activity, Activity::Jogging(_)) {
            // What changes from tick to tick is looked at in each.
            return 0;
        }
        let mut left = TELEMETRY_US as u32;
        let mut after = |since: Micros, span_us: u64| {
            // Five seconds at the most, or never.
            let at = since.0.saturating_add(span_us);
            if at > now.0 {
                left = left.min((at - now.0) as u32);
            }
        };
        if self.greeted {
            after(self.told, TELEMETRY_US);
        }
        if let Some(params) = &self.params
            && let Activity::Seeking(seek) = &self.activity
        {
            let deadlines = &params.deadlines;
            let (asked, lasts_us) = seek.lasts();
            after(asked, lasts_us);
            after(self.heard, limit_us(deadlines.host) + 1);
            if let Some(since) = self.unseen_since() {
                after(since, coasting_us(deadlines.position) + 1);
                after(since, limit_us(deadlines.position) + 1);
            }
        }
        ((left - 1) / TICK_US).min(self.asking.idle_ticks(now))
    }

    /// How long the ball was not seen, or the target is waiting for its first position, µs; `None` without a target.
    fn unseen_us(&self, now: Micros) -> Option<u64> {
        self.unseen_since().map(|since| now.since(since))
    }

    /// When the ball was last seen, or the target set that waits for its first position; `None` without a target.
    fn unseen_since(&self) -> Option<Micros> {
        let Activity::Seeking(seek) = &self.activity else {
            return None;
        };
        Some(self.sight.captured.map_or(seek.since, |captured| captured.max(seek.since)))
    }
}
