//! What stops the board by itself as time passes.

use plumb_protocol::message::Fault;
use plumb_protocol::units::{Micros, Milliseconds};

use super::{Activity, Board, TELEMETRY_US};
use crate::clock::TICK_US;

/// Whether `span_us` is longer than `limit`.
fn exceeds(span_us: u64, limit: Milliseconds) -> bool {
    span_us > limit_us(limit)
}

/// `limit`, µs.
fn limit_us(limit: Milliseconds) -> u64 {
    // 16 + 10 bits: a product of 32 costs the chip a clock, one of 64 forty.
    u64::from(u32::from(limit.0) * 1000)
}

/// How long the ball may be unseen before the rates are cut, µs: two fifths of the deadline, which
/// at 500 ms and 30 Hz is six pictures.
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
        if exceeds(now.since(self.last_rx), deadlines.host) {
            return Some(Fault::HostSilent);
        }
        under_way.filter(|&span| exceeds(span, deadlines.position)).map(|_| Fault::PositionLost)
    }

    /// Since when positions have failed to come for so long that the rates are cut, if they have.
    pub(super) fn coasting(&self, now: Micros) -> Option<Micros> {
        let since = self.unseen_since()?.0 + coasting_us(self.params.as_ref()?.deadlines.position);
        (now.0 > since).then_some(Micros(since))
    }

    /// Returns the number of ticks after that at `now` that need no check of deadlines or
    /// telemetry; 0 where one is overdue. An event may put a deadline off. An event that brings a
    /// deadline nearer is attended to, and this is called again.
    #[inline(never)]
    pub(super) fn ticks_to_deadline(&self, now: Micros) -> u32 {
        if self.bootloader
            || self.storing.is_some()
            || matches!(self.activity, Activity::Jogging(_))
        {
            // What changes from tick to tick is looked at in each.
            return 0;
        }
        let mut schedule = Schedule { now: now.0, left: TELEMETRY_US as u32 };
        if self.greeted {
            schedule.deadline(self.last_telemetry, TELEMETRY_US);
        }
        if let Some(params) = &self.params
            && let Activity::Seeking(seek) = &self.activity
        {
            let deadlines = &params.deadlines;
            let (asked, valid_us) = seek.lasts();
            schedule.milestone(asked, valid_us);
            schedule.deadline(self.last_rx, limit_us(deadlines.host) + 1);
            if let Some(since) = self.unseen_since() {
                schedule.milestone(since, coasting_us(deadlines.position) + 1);
                schedule.deadline(since, limit_us(deadlines.position) + 1);
            }
        }
        (schedule.left.saturating_sub(1) / TICK_US).min(self.law_client.ticks_to_due(now))
    }

    /// Returns the time since [`unseen_since`](Self::unseen_since), µs; `None` without a target.
    fn unseen_us(&self, now: Micros) -> Option<u64> {
        self.unseen_since().map(|since| now.since(since))
    }

    /// Returns when the ball was last seen, but not before the drive began; `None` without a
    /// target. A change of the target does not begin another drive.
    fn unseen_since(&self) -> Option<Micros> {
        if !matches!(self.activity, Activity::Seeking(_)) {
            return None;
        }
        let since = self.guards.since;
        Some(self.sight.captured.map_or(since, |captured| captured.max(since)))
    }
}

/// Time until the next check of deadlines, telemetry and setpoint.
struct Schedule {
    /// µs.
    now: u64,
    /// µs; at most a telemetry interval.
    left: u32,
}

impl Schedule {
    /// Adds a deadline `span_us` after `since`. A deadline that has passed is due at once.
    fn deadline(&mut self, since: Micros, span_us: u64) {
        let at = since.0.saturating_add(span_us);
        self.left = if at > self.now { self.left.min((at - self.now) as u32) } else { 0 };
    }

    /// Adds the moment, `span_us` after `since`, at which the setpoint on the motors changes. A
    /// moment that has passed is ignored: every check reads the present setpoint.
    fn milestone(&mut self, since: Micros, span_us: u64) {
        let at = since.0.saturating_add(span_us);
        if at > self.now {
            self.left = self.left.min((at - self.now) as u32);
        }
    }
}
