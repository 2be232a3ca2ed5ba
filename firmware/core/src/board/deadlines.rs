//! Deadlines of the board: which has passed, and when the next one does.

use plumb_protocol::message::Fault;
use plumb_protocol::units::Micros;

use super::Board;
use super::schedule::TELEMETRY_US;
use super::state::{AfterStop, State};
use crate::servo::{coasting_us, limit_us};
use crate::timing::TICK_US;

impl Board {
    /// Returns the fault of a deadline that has passed.
    pub(super) fn expired_deadline(&self, now: Micros) -> Option<Fault> {
        let params = self.setup.params()?;
        if !self.state.is_driven() {
            return None;
        }
        if now.since(self.session.last_rx) > limit_us(params.config.deadlines.host) {
            return Some(Fault::HostSilent);
        }
        let lost = self.state.needs_positions() && self.servo.position_lost(now, params);
        lost.then_some(Fault::PositionLost)
    }

    /// Returns the number of ticks after that at `now` that need no check of deadlines, setpoint or
    /// telemetry; 0 where one is overdue. An event may put a deadline off. An event that brings a
    /// deadline nearer makes the schedule dirty, and this is called again.
    #[inline(never)]
    pub(super) fn poll_at(&self, now: Micros) -> u32 {
        let each_tick = match &self.state {
            State::Jogging(_)
            | State::Settling(_)
            | State::Stopping { then: AfterStop::Bootloader } => true,
            State::Fault { then: AfterStop::Bootloader, .. } => true,
            state => state.flash_job().is_some(),
        };
        if each_tick {
            return 0;
        }
        let mut timer = Timer { now: now.0, left: TELEMETRY_US as u32 };
        if let Some(ready) = self.schedule.drivers_ready {
            timer.milestone(ready, 0);
        }
        if self.session.greeted {
            timer.deadline(self.session.last_telemetry, TELEMETRY_US);
        }
        if let Some(params) = self.setup.params()
            && self.state.goal().is_some()
        {
            let deadlines = &params.config.deadlines;
            if let Some(step) = self.servo.next_reference_step(params) {
                timer.deadline(step, 0);
            }
            let (since, valid_us) = self.servo.setpoint_validity();
            timer.milestone(since, valid_us);
            timer.deadline(self.session.last_rx, limit_us(deadlines.host) + 1);
            let last_seen = self.servo.last_seen();
            timer.milestone(last_seen, coasting_us(deadlines.position) + 1);
            timer.milestone(last_seen, limit_us(deadlines.position) + 1);
            timer.deadline(last_seen, self.servo.patience_us(params) + 1);
        }
        (timer.left.saturating_sub(1) / TICK_US).min(self.servo.client().ticks_to_due(now))
    }
}

/// Time until the next deadline.
struct Timer {
    /// The present time, µs.
    now: u64,
    /// Time left, µs; at most a telemetry interval.
    left: u32,
}

impl Timer {
    /// Adds a deadline `span_us` after `since`. A deadline that has passed is due at once.
    fn deadline(&mut self, since: Micros, span_us: u64) {
        let at = since.0.saturating_add(span_us);
        self.left = if at > self.now { self.left.min((at - self.now) as u32) } else { 0 };
    }

    /// Adds a moment, `span_us` after `since`, at which the setpoint changes. A moment that has
    /// passed is ignored: every check reads the present setpoint.
    fn milestone(&mut self, since: Micros, span_us: u64) {
        let at = since.0.saturating_add(span_us);
        if at > self.now {
            self.left = self.left.min((at - self.now) as u32);
        }
    }
}
