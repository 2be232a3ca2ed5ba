//! What is due, and when.

use plumb_protocol::message::Fault;
use plumb_protocol::units::Micros;

use super::Board;
use super::state::{AfterStop, State};
use crate::servo::{coasting_us, limit_us};
use crate::timing::TICK_US;

/// Longest time between two telemetries once a host was greeted, µs.
pub(super) const TELEMETRY_US: u64 = 100_000;

/// Ticks from the last report of an open emergency input until it counts as closed: the tick that
/// the report precedes, and one that no report precedes.
pub(super) const EMERGENCY_TICKS: u8 = 2;

/// Set-up of motor drivers over their UART, which the chip carries out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DriverSetup {
    /// The drivers are set up, or have no UART.
    Done,
    /// The drivers are set up again after a fault of one. They stay on; the motors wait.
    Again,
    /// The drivers are set up after a configuration. They are off until then.
    First,
}

/// What the coming tick has to do besides its pulses.
#[derive(Debug)]
pub(super) struct Schedule {
    /// Whether an event is to be handled in the coming tick.
    pub(super) dirty: bool,
    /// Whether an event was handled in this tick.
    pub(super) had_event: bool,
    /// Ticks until one with an expired deadline.
    pub(super) idle_ticks: u32,
    /// Whether the second half of the coming tick has a position's progress or the end of a stop to
    /// check.
    pub(super) check_due: bool,
    /// Whether telemetry is to be sent after this tick.
    pub(super) telemetry_due: bool,
    /// Ticks to be planned until the emergency input counts as closed.
    pub(super) emergency_ticks: u8,
    /// Whether the drivers are on.
    pub(super) drivers_on: bool,
    /// Set-up of the drivers over their UART.
    pub(super) driver_setup: DriverSetup,
    /// When drivers that were switched on will take pulses; `None` once they do.
    pub(super) drivers_ready: Option<Micros>,
}

impl Schedule {
    /// Creates the schedule of a board that has just started.
    pub(super) fn new() -> Self {
        Self {
            dirty: true,
            had_event: false,
            idle_ticks: 0,
            check_due: false,
            telemetry_due: false,
            emergency_ticks: 0,
            drivers_on: false,
            driver_setup: DriverSetup::Done,
            drivers_ready: None,
        }
    }

    /// Returns whether the drivers are set up and take pulses.
    #[inline(always)]
    pub(super) fn can_move(&self) -> bool {
        self.drivers_ready.is_none() && self.driver_setup == DriverSetup::Done
    }
}

impl Board {
    /// Returns the fault of a deadline that has passed.
    pub(super) fn expired_deadline(&self, now: Micros) -> Option<Fault> {
        let params = self.setup.params()?;
        if !self.state.is_driven() {
            return None;
        }
        if now.since(self.session.last_rx) > limit_us(params.deadlines.host) {
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
            state => state.storing().is_some(),
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
            let deadlines = &params.deadlines;
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
