//! Execution of commands.

use plumb_protocol::config::{Config, Workspace};
use plumb_protocol::message::{
    BoardHello, Command, Fault, FromBoard, Hello, Jog, Position, Reference, Refusal, Request,
    ToBoard,
};
use plumb_protocol::units::{Micrometres, Micros, Point, Speed};
use plumb_protocol::wiring::Wiring;

use super::admit::{admit, admit_position};
use super::schedule::DriverSetup;
use super::session::RequestKey;
use super::state::{AfterStop, FlashJob, FlashTask, Goal, Settling, State};
use super::{Board, Outbox};
use crate::law::LawSelection;
use crate::params::Params;
use crate::plan::Jogging;
use crate::servo::{BallPosition, MotorPositions, limit_us};

/// Frames in a row with the ball outside the workspace after which the board stops: one may be a
/// false detection.
const MAX_OUTSIDE: u8 = 3;

/// Highest rate of a motor on its way back into its travel, Q8 steps/s: 20 steps/s, about a
/// centimetre a second.
const MAX_RETURN_RATE: i32 = 20 << 8;

/// Range of the time between two knots of a reference, µs.
const KNOT_INTERVAL_US: core::ops::RangeInclusive<u32> = 10_000..=500_000;

/// Highest velocity of a knot along an axis, µm/s.
const MAX_KNOT_SPEED: u32 = 2_000_000;

/// Returns whether a repetition of `command` is answered and not carried out again. The others
/// leave the board in the same state, or count themselves.
fn is_once(command: &Command) -> bool {
    !matches!(
        command,
        Command::Hello(_)
            | Command::Stop
            | Command::Bootloader
            | Command::Position(_)
            | Command::Status
            | Command::Diagnose
            | Command::Measure
            | Command::Follow(_)
            | Command::Wire(_)
            | Command::Prior(_)
    )
}

/// Returns whether another message than an answer follows `command` where it is carried out.
fn has_own_message(command: &Command) -> bool {
    matches!(
        command,
        Command::Hello(_) | Command::Position(_) | Command::Diagnose | Command::Measure
    )
}

/// Checks the interval and the velocities of a reference, and its knots against the workspace.
#[inline(never)]
fn check_reference(reference: &Reference, workspace: &Workspace) -> Result<(), Refusal> {
    let is_slow = |speed: &Speed| speed.0.unsigned_abs() <= MAX_KNOT_SPEED;
    if !KNOT_INTERVAL_US.contains(&reference.interval_us)
        || !reference.knots.iter().all(|knot| knot.velocity.iter().all(is_slow))
    {
        return Err(Refusal::ReferenceRange);
    }
    let is_inside = reference.knots.iter().all(|knot| workspace.contains(knot.position));
    if is_inside { Ok(()) } else { Err(Refusal::ReferenceOutside) }
}

impl Board {
    /// Executes a command and answers it. A repetition of the last one that is carried out once,
    /// with its id and CRC, is only answered again. A Store is answered once it is written.
    pub(super) fn on_command(&mut self, now: Micros, request: &Request, out: &mut Outbox) {
        self.session.last_rx = now;
        let ToBoard { id, ref command } = request.message;
        let key = RequestKey::of(request);
        let is_repetition = self.session.greeted && self.session.last_request == Some(key);
        let result = if is_repetition { Ok(()) } else { self.execute(now, request, out) };
        if result.is_ok() && is_once(command) {
            self.session.last_request = Some(key);
        }
        let is_pending = self.state.flash_job().is_some_and(|job| job.request == key);
        if result.is_err() || !(is_pending || has_own_message(command)) {
            out.answer(now, id, result);
        }
    }

    /// Checks the session, the flash and the state for `command`.
    fn admit(&self, command: &Command) -> Result<(), Refusal> {
        if !matches!(command, Command::Hello(_) | Command::Stop | Command::Bootloader) {
            self.session.require_greeting()?;
        }
        let uses_flash = matches!(command, Command::Store | Command::TestFlash);
        if uses_flash && !self.setup.build.storage {
            return Err(Refusal::Unsupported);
        }
        admit(&self.state, command)
    }

    fn execute(&mut self, now: Micros, request: &Request, out: &mut Outbox) -> Result<(), Refusal> {
        let ToBoard { id, ref command } = request.message;
        self.admit(command)?;
        match *command {
            Command::Hello(hello) => self.hello(id, hello, out),
            Command::Stop => self.stop(),
            Command::Bootloader => self.state = self.state.leaving(),
            Command::Configure(ref config) => self.configure(id, config)?,
            Command::Position(ref position) => {
                self.position(now, position, out)?;
                self.schedule.telemetry_due = true;
            }
            Command::Target(target) => self.target(now, id, target, out)?,
            Command::Jog(jog) => self.jog(now, jog)?,
            Command::Hold => self.hold(now, id)?,
            Command::ClearFault => self.clear_fault()?,
            Command::Status => self.send_telemetry(now, out),
            Command::Store => self.use_flash(request, FlashTask::Store)?,
            Command::Home => self.home()?,
            Command::Follow(ref reference) => self.follow(now, id, reference, out)?,
            Command::Diagnose => self.session.diagnosis = Some(id),
            Command::Measure => self.measure(id)?,
            Command::TestFlash => self.use_flash(request, FlashTask::Test)?,
            Command::Wire(ref wiring) => self.wire(wiring)?,
            Command::Prior(ref prior) => {
                self.setup.check_prior(prior)?;
                self.servo.know(*prior);
            }
            Command::Rates(_) | Command::Pen(_) => return Err(Refusal::Unsupported),
        }
        Ok(())
    }

    /// Takes in a position, command `id`: [`on_frame`](Self::on_frame) for a caller that has
    /// decoded the position already. Telemetry answers an accepted one.
    #[inline(never)]
    pub fn on_position(&mut self, now: Micros, id: u16, position: &Position, out: &mut Outbox) {
        (self.schedule.dirty, self.session.last_rx) = (true, now);
        match self.position(now, position, out) {
            Ok(()) => self.schedule.telemetry_due = true,
            refused => out.answer(now, id, refused),
        }
    }

    fn position(
        &mut self,
        now: Micros,
        position: &Position,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        self.session.require_greeting()?;
        admit_position(&self.state)?;
        let params = self.setup.require()?;
        self.session.check_order(position.sequence)?;
        if u64::from(position.age_us) > limit_us(params.config.deadlines.max_age) {
            return Err(Refusal::PositionStale);
        }
        self.session.sequence = Some(position.sequence);
        let Some(ball) = position.ball else { return Ok(()) };
        if !params.config.workspace.contains(ball) {
            self.ball_outside(now, out);
            return Err(Refusal::BallOutside);
        }
        let captured = now.back(u64::from(position.age_us));
        let ball = ball.micrometres();
        let position = BallPosition { captured, ball, covariance: position.covariance };
        let target = self.state.goal().map(|goal| goal.target);
        self.servo.on_position(now, &position, target, &MotorPositions::UNUSED, params);
        self.schedule.check_due |= target.is_some();
        Ok(())
    }

    /// Counts a frame with the ball outside the workspace. A driven board stops when it happens
    /// repeatedly.
    fn ball_outside(&mut self, now: Micros, out: &mut Outbox) {
        let count = self.servo.tracker_mut().count_outside();
        if self.state.is_driven() && count >= MAX_OUTSIDE {
            self.fault(now, Fault::BallOutside, out);
        }
    }

    /// Begins a session. A host of another version may look, and stop, but not move anything.
    fn hello(&mut self, id: u16, hello: Hello, out: &mut Outbox) {
        let accepted = self.session.greet(hello);
        if accepted {
            self.state.forget_command();
            self.setup.staged = None;
        } else {
            self.stop();
        }
        let max_pulse_rate = self.setup.build.max_pulse_rate;
        out.send(&FromBoard::Hello(BoardHello {
            id,
            hello: Hello::OURS,
            max_pulse_rate,
            accepted,
        }));
        out.send(&FromBoard::Provenance(self.session.provenance));
        if accepted {
            out.send(&FromBoard::Started(self.session.start_cause));
        }
    }

    fn stop(&mut self) {
        self.state = self.state.stopped();
        if self.state == (State::Stopping { then: AfterStop::Ready }) {
            self.settle();
        }
    }

    /// Takes in the wiring of the next configuration.
    #[cold]
    fn wire(&mut self, wiring: &Wiring) -> Result<(), Refusal> {
        wiring.check(self.setup.build.chip).map_err(Refusal::Wiring)?;
        self.setup.staged = Some(*wiring);
        Ok(())
    }

    #[cold]
    fn configure(&mut self, id: u16, config: &Config) -> Result<(), Refusal> {
        let wiring = self.setup.staged.ok_or(Refusal::NotWired)?;
        let params = self.setup.check(&wiring, config)?;
        self.apply_config(params, &wiring);
        self.session.configuration = Some(id);
        Ok(())
    }

    /// Puts `params`, which were made with `wiring`, into force; at standstill. Where pins and
    /// drivers do not change, the motors keep their current.
    #[cold]
    pub(super) fn apply_config(&mut self, params: Params, wiring: &Wiring) {
        self.planner.configure(&params);
        // A command has time to build the law, a position has not.
        self.servo.configure(match params.law() {
            LawSelection::Inline(law) => Some(law),
            LawSelection::Deferred(_) => None,
        });
        if self.setup.apply(params, wiring) {
            // New drivers are switched off first.
            self.schedule.drivers_on = false;
            let first = wiring.drivers.tmc2209().map(|_| DriverSetup::First);
            self.schedule.driver_setup = first.unwrap_or(DriverSetup::Done);
        }
        if self.state == State::Unconfigured {
            self.state = State::Ready;
        }
    }

    /// Has the configuration written, or the flash tested. A board that stands in a fault may
    /// store, too.
    #[cold]
    fn use_flash(&mut self, request: &Request, task: FlashTask) -> Result<(), Refusal> {
        self.setup.require()?;
        self.require_rest()?;
        self.state = self.state.storing(FlashJob { request: RequestKey::of(request), task });
        Ok(())
    }

    fn target(
        &mut self,
        now: Micros,
        id: u16,
        target: Point,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        if !self.setup.require()?.config.workspace.contains(target) {
            if self.state.goal().is_some() {
                self.fault(now, Fault::TargetOutside, out);
            }
            return Err(Refusal::TargetOutside);
        }
        self.setup.require()?.check_travel(self.travel_positions())?;
        self.drive_to(now, State::Seeking(Goal { target, command: Some(id) }));
        Ok(())
    }

    /// Follows a path, or goes on with its next part. From rest the reference begins at the target,
    /// and in a drive where the ball is.
    #[inline(never)]
    fn follow(
        &mut self,
        now: Micros,
        id: u16,
        reference: &Reference,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let params = self.setup.require()?;
        let checked = check_reference(reference, &params.config.workspace);
        let limit_us = limit_us(params.config.deadlines.position);
        if checked == Err(Refusal::ReferenceOutside) && self.state.goal().is_some() {
            self.fault(now, Fault::TargetOutside, out);
        }
        checked?;
        if let State::Following(goal) = &mut self.state
            && let Some(is_newer) = self.servo.follow_on(now, reference)
        {
            if !is_newer {
                return Err(Refusal::ReferenceOutOfOrder);
            }
            goal.command = Some(id);
            return Ok(());
        }
        self.setup.require()?.check_travel(self.travel_positions())?;
        let start = match self.state {
            State::Holding(goal) => goal.target,
            _ => Point(self.fresh_ball(now, limit_us)?.map(Micrometres)),
        };
        self.drive_to(now, State::Following(Goal { target: start, command: Some(id) }));
        self.servo.follow(now, start, reference);
        Ok(())
    }

    /// Returns the filtered position of the ball, µm, where one came within `limit_us`.
    fn fresh_ball(&self, now: Micros, limit_us: u64) -> Result<[i32; 3], Refusal> {
        let tracker = self.servo.tracker();
        let fresh = tracker.captured().is_some_and(|captured| now.since(captured) <= limit_us);
        tracker.filtered().filter(|_| fresh).ok_or(Refusal::NoPosition)
    }

    /// Holds the ball where it is. While motors turn, they ramp down first: a law that is to bring
    /// a moving ball back would overshoot.
    fn hold(&mut self, now: Micros, id: u16) -> Result<(), Refusal> {
        let params = self.setup.require()?;
        params.check_travel(self.travel_positions())?;
        let here = self.fresh_ball(now, limit_us(params.config.deadlines.position))?;
        if self.planner.moving() {
            self.state = State::Settling(Settling::new(id));
            self.schedule.check_due = true;
            return Ok(());
        }
        let target = Point(here.map(Micrometres));
        self.drive_to(now, State::Holding(Goal { target, command: Some(id) }));
        Ok(())
    }

    /// Begins a drive with the goal of `state`, or goes on with it. The guards of a drive end once
    /// a position shows the ball at standstill, not before: targets that come often must not
    /// disarm them.
    fn drive_to(&mut self, now: Micros, state: State) {
        if let Some(params) = self.setup.params() {
            self.servo.leave_target(now, params);
        }
        if self.state.goal().is_some() {
            self.servo.change_target(now);
            // A deadline that a path waits beyond counts at once.
            self.schedule.idle_ticks = 0;
        } else {
            self.servo.begin_drive(now, &self.planner);
        }
        self.state = state;
    }

    /// Turns one motor. One that stands outside its travel may only come back, and slowly.
    fn jog(&mut self, now: Micros, jog: Jog) -> Result<(), Refusal> {
        let params = self.setup.require()?;
        let motor = usize::from(jog.motor);
        let limits = params.motor(motor).ok_or(Refusal::NoSuchMotor)?;
        if !(1..=limits.max_rate.min(params.config.jog.max_rate).0).contains(&jog.rate.0) {
            return Err(Refusal::JogRate);
        }
        if jog.distance.0.unsigned_abs() > params.config.jog.max_distance.0.unsigned_abs() {
            return Err(Refusal::JogDistance);
        }
        let position = self.travel_positions()[motor];
        let end = position.saturating_add(jog.distance.0);
        let (low, high) = (limits.travel_min.0, limits.travel_max.0);
        if !(low.min(position)..=high.max(position)).contains(&end) {
            return Err(Refusal::JogTravel);
        }
        let inside = (low..=high).contains(&position);
        let rate = if inside { jog.rate.0 } else { jog.rate.0.min(MAX_RETURN_RATE) };
        let end = end + self.planner.zero()[motor];
        self.state = State::Jogging(Jogging::new(motor, end, rate));
        self.servo.end_drive(now);
        Ok(())
    }

    /// Makes the present motor positions the zero of travel.
    #[cold]
    fn home(&mut self) -> Result<(), Refusal> {
        self.planner.home(self.setup.require()?);
        Ok(())
    }

    #[cold]
    fn clear_fault(&mut self) -> Result<(), Refusal> {
        let State::Fault { fault, .. } = self.state else { return Ok(()) };
        if self.schedule.emergency_ticks > 0 {
            // The emergency input has not closed yet.
            return Err(Refusal::Faulted(fault));
        }
        self.require_rest()?;
        let configured = self.setup.params().is_some();
        self.state = if configured { State::Ready } else { State::Unconfigured };
        self.servo.tracker_mut().clear_outside();
        Ok(())
    }

    /// Has the chip measure.
    #[cold]
    fn measure(&mut self, id: u16) -> Result<(), Refusal> {
        if self.setup.wiring().is_some_and(|wiring| wiring.drivers.step_dir().is_none()) {
            return Err(Refusal::CoilsConfigured);
        }
        self.session.measurement = Some(id);
        Ok(())
    }

    /// Checks that the motors stand.
    fn require_rest(&self) -> Result<(), Refusal> {
        if self.planner.moving() { Err(Refusal::Busy(self.state())) } else { Ok(()) }
    }
}
