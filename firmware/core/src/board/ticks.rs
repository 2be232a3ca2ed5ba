//! The two halves of a tick.

use plumb_protocol::message::Fault;
use plumb_protocol::units::{Micrometres, Micros, Point};

use super::schedule::{DriverSetup, TELEMETRY_US};
use super::state::{AfterStop, Goal, Settling, State};
use super::{Board, Outbox, Tick};
use crate::law::{MotorRates, Setpoint};
use crate::law_worker::{LawRequest, LawWorker};
use crate::servo::ReferenceTick;

impl Board {
    /// Plans and reports the tick that begins at `now`; call every
    /// [`TICK_US`](crate::timing::TICK_US). This is [`plan`](Self::plan), [`report`](Self::report),
    /// and a response of `law_worker` at once: for hosts, where the law takes no board time.
    pub fn tick(
        &mut self,
        now: Micros,
        law_worker: &mut LawWorker,
        out: &mut Outbox,
    ) -> Option<Tick> {
        let tick = self.plan(now, out);
        self.report(now, out);
        if let Some(request) = self.take_law_request() {
            self.on_law_response(&law_worker.respond(&request));
        }
        tick
    }

    /// Runs the first half of a tick: plans its [pulses](Self::pulses). Returns what else the chip
    /// carries out, where that may have changed. The chip gives the pulses to its step generator
    /// before the second half.
    #[inline]
    pub fn plan(&mut self, now: Micros, out: &mut Outbox) -> Option<Tick> {
        if self.schedule.dirty || self.schedule.idle_ticks == 0 {
            return Some(self.run_due(now, out));
        }
        self.schedule.idle_ticks -= 1;
        self.plan_pulses(now, out);
        None
    }

    /// Runs the second half of a tick: the check of the progress, law requests, telemetry after a
    /// position and from time to time, and the next deadline.
    #[inline]
    pub fn report(&mut self, now: Micros, out: &mut Outbox) {
        self.planner.follow_up();
        // After an event `idle_ticks` is 0, so that a tick without one has two checks only.
        if self.schedule.idle_ticks == 0 || self.schedule.check_due {
            self.report_due(now, out);
        }
    }

    /// Reports what an event or an expired deadline has made due.
    #[inline(never)]
    fn report_due(&mut self, now: Micros, out: &mut Outbox) {
        let schedule = &self.schedule;
        let is_busy = schedule.had_event || schedule.check_due || schedule.telemetry_due;
        self.servo.update_guards(now, &self.planner);
        if self.schedule.check_due {
            self.check(now, out);
        }
        self.advance_reference(now, is_busy);
        if self.schedule.idle_ticks == 0 {
            self.schedule.idle_ticks = self.poll_at(now);
        }
        let requested = self.servo.client().has_pending() && self.make_law_request(now);
        if !self.schedule.telemetry_due {
            return;
        }
        if requested {
            // A tick has no time for both. The telemetry follows in the next one.
            self.schedule.idle_ticks = 0;
        } else {
            self.send_telemetry(now, out);
        }
    }

    /// Returns the request for the [`LawWorker`] that this tick has made, once. Call after every
    /// [`report`](Self::report).
    #[inline]
    pub fn take_law_request(&mut self) -> Option<LawRequest> {
        self.servo.take_request()
    }

    /// Handles pending events and expired deadlines, and plans the pulses.
    #[inline(never)]
    fn run_due(&mut self, now: Micros, out: &mut Outbox) -> Tick {
        // Before that tick no deadline has passed.
        let due = self.schedule.idle_ticks == 0;
        self.schedule.had_event = self.schedule.dirty;
        if due && let Some(fault) = self.expired_deadline(now) {
            self.fault(now, fault, out);
        }
        self.apply_law_response(now, out);
        let drivers_enabled = self.enable_drivers(now);
        let setpoint = self.setpoint(now);
        self.planner.follow(&setpoint);
        let overdue = now.since(self.session.last_telemetry) >= TELEMETRY_US;
        self.schedule.telemetry_due |= due && self.session.greeted && overdue;
        self.schedule.emergency_ticks = self.schedule.emergency_ticks.saturating_sub(1);
        (self.schedule.dirty, self.schedule.idle_ticks) = (self.schedule.emergency_ticks > 0, 0);
        self.plan_pulses(now, out);
        Tick {
            drivers_enabled,
            bootloader: self.state.leaves() && !self.planner.moving(),
            flash: self.state.flash_job().map(|job| job.task),
            diagnose: self.session.diagnosis.is_some(),
            measure: self.session.measurement.is_some(),
            set_up_drivers: self.schedule.driver_setup != DriverSetup::Done
                && !matches!(self.state, State::Fault { .. }),
        }
    }

    /// Returns whether the drivers are on from this tick on. After they are switched on, the motors
    /// wait until they take pulses.
    fn enable_drivers(&mut self, now: Micros) -> bool {
        let off = matches!(
            self.state,
            State::Fault { fault: Fault::EmergencyStop | Fault::Watchdog, .. }
        );
        let enabled = self.session.was_greeted
            && self.setup.params().is_some()
            && self.schedule.driver_setup != DriverSetup::First
            && !off;
        if enabled != self.schedule.drivers_on {
            self.switch_drivers(now, enabled);
        }
        self.schedule.drivers_ready.take_if(|ready| *ready <= now);
        enabled
    }

    #[cold]
    fn switch_drivers(&mut self, now: Micros, on: bool) {
        self.schedule.drivers_on = on;
        self.schedule.drivers_ready = on.then(|| Micros(now.0 + self.setup.enable_us()));
    }

    #[inline(always)]
    fn plan_pulses(&mut self, now: Micros, out: &mut Outbox) {
        if let Some(motor) = self.planner.plan_tick() {
            self.fault(now, Fault::Travel(motor as u8), out);
        }
    }

    /// Returns the setpoint of the present state: none before the drivers are set up and ready. A
    /// jog that has arrived ends.
    fn setpoint(&mut self, now: Micros) -> Setpoint {
        if !self.schedule.can_move() {
            return Setpoint::default();
        }
        if let State::Jogging(jogging) = &self.state {
            return Setpoint::at_once(jogging.wanted(&self.planner).unwrap_or_else(|| {
                self.state = State::Stopping { then: AfterStop::Ready };
                self.schedule.check_due = true;
                MotorRates::default()
            }));
        }
        match (self.state.goal(), self.setup.params()) {
            (Some(_), Some(params)) => self.servo.setpoint(now, params),
            _ => Setpoint::default(),
        }
    }

    /// Advances the reference where that is due, and notes where it is.
    #[inline(never)]
    fn advance_reference(&mut self, now: Micros, is_busy: bool) {
        let (State::Following(goal), Some(params)) = (&mut self.state, self.setup.params()) else {
            return;
        };
        let tick = ReferenceTick { is_busy, can_move: self.schedule.can_move() };
        if let Some(target) = self.servo.advance_reference(now, tick, params) {
            goal.target = target;
        }
    }

    /// Checks after a position how the drive goes on, and in a stop or before a hold whether motors
    /// and ball rest. This runs in the second half of a tick, where there is time for it.
    #[inline(never)]
    fn check(&mut self, now: Micros, out: &mut Outbox) {
        self.schedule.check_due = false;
        match self.state {
            State::Seeking(goal) | State::Holding(goal) | State::Following(goal) => {
                self.check_progress(now, goal, out);
            }
            State::Settling(settling) => self.check_settling(settling),
            State::Stopping { then: AfterStop::Ready } => self.settle(),
            _ => {}
        }
    }

    /// Holds the ball once it has come to rest. Otherwise the next tick checks again.
    fn check_settling(&mut self, mut settling: Settling) {
        let tracker = self.servo.tracker();
        let rests = settling.update(self.planner.moving(), tracker.captured());
        let Some(here) = tracker.filtered().filter(|_| rests) else {
            self.state = State::Settling(settling);
            self.schedule.check_due = true;
            return;
        };
        // The deadline of positions counts from the newest one.
        self.servo.begin_drive(self.servo.last_seen(), &self.planner);
        let target = Point(here.map(Micrometres));
        self.state = State::Holding(Goal { target, command: settling.command });
        self.schedule.dirty = true;
    }

    /// Checks whether the target is reached, and whether a guard stops the drive.
    fn check_progress(&mut self, now: Micros, goal: Goal, out: &mut Outbox) {
        let Some(params) = self.setup.params() else { return };
        let progress = self.servo.check_progress(now, goal.target, &self.planner, params);
        if progress.reached {
            let target = self.servo.end_following().unwrap_or(goal.target);
            self.state = State::Holding(Goal { target, ..goal });
        }
        if let Some(fault) = progress.fault {
            self.fault(now, fault, out);
        }
    }

    /// Ends a stop where the motors stand. Otherwise the next tick checks again.
    pub(super) fn settle(&mut self) {
        if self.planner.moving() {
            self.schedule.check_due = true;
        } else {
            self.state = State::Ready;
        }
    }

    /// Makes a law request of the position that waits, where there is a target. Returns whether it
    /// has made one.
    #[inline(never)]
    fn make_law_request(&mut self, now: Micros) -> bool {
        let Some(params) = self.setup.params() else { return false };
        let target = self.state.goal().map(|goal| goal.target);
        let made = self.servo.make_request(now, target, &self.planner, params);
        if made {
            // The tick in which the response takes effect is a due one.
            let ticks = self.servo.client().ticks_to_due(now);
            self.schedule.idle_ticks = self.schedule.idle_ticks.min(ticks);
        }
        made
    }

    /// Applies the law response that takes effect at `now`, where the board still drives.
    fn apply_law_response(&mut self, now: Micros, out: &mut Outbox) {
        let Some(params) = self.setup.params() else { return };
        let applied = self.servo.apply_response(now, params);
        if applied.is_err() && self.state.goal().is_some() {
            self.fault(now, Fault::LawLate, out);
        }
    }
}
