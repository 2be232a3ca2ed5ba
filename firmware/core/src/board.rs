//! The board: commands, states, and when each part runs. Its inputs are frames and time.
//!
//! ```text
//! frames -> on_command -> admit -> State, Setup, Servo
//!        -> on_position ---------> Servo -> setpoint
//! time   -> plan -> Schedule -> run_due: deadlines, setpoint of the State -> Planner -> pulses
//!        -> report: progress, law requests, telemetry
//! ```
//!
//! # States
//!
//! ```text
//!              Configure            Target                     reached
//! Unconfigured ---------> Ready --------------------> Seeking --------> Holding
//!                         | | |  Hold                    ^      Target     |  ^
//!                         | | +--------------------------|-----------------|--+
//!                         | |                            +-----------------+
//!                         | | Jog              Stop, or the jog's end
//!                         | +-----> Jogging ----------------------> Stopping { then: Ready }
//!                         |         Seeking, Holding ---Stop------> Stopping { then: Ready }
//!                         |                                           | at rest: Ready
//!                         | Store, TestFlash             Target, Hold | Seeking, Holding
//!                         +-----> Storing { job } ---written or not--> Ready
//!
//! Ready, Seeking, Holding, Settling, Stopping ---Follow---> Following ---end of path---> Holding
//!
//! any ---Bootloader, once what is under way has ended---> Stopping { then: Bootloader } -> restart
//! any ---guard, deadline, emergency input---> Fault ---ClearFault, at rest---> Ready, Unconfigured
//! ```
//!
//! Home changes the zero of travel in Ready, and no state. Hold while motors turn goes through
//! Settling: the motors ramp down, the ball comes to rest, and Holding follows.
//! `admit` (board/admit.rs) is the table of the commands that each state accepts. A fault is
//! latched; an emergency stop alone replaces another fault. A write to flash and a restart into the
//! bootloader go on in a fault.

mod admit;
mod commands;
mod deadlines;
mod outbox;
mod schedule;
mod session;
mod setup;
mod state;
mod ticks;

use plumb_protocol::config::Config;
use plumb_protocol::diagnostics::{ChipCounts, ChipMeasurement, Diagnostics, Measurement};
use plumb_protocol::frame::FrameError;
use plumb_protocol::message::{
    self, DriverFault, DriverReading, DriverReport, Fault, FaultReport, FromBoard, Refusal,
    Request, StartCause, Telemetry,
};
use plumb_protocol::provenance::Provenance;
use plumb_protocol::units::{Micrometres, Micros, Point, Rate, Steps16};
use plumb_protocol::{MotorList, PerMotor, Wiring};

use crate::law_worker::LawResponse;
use crate::params::BuildLimits;
use crate::plan::{Planner, StepPlan};
use crate::servo::Servo;
use crate::timing::DriverTiming;
use crate::vector::per_motor;
use schedule::{DriverSetup, EMERGENCY_TICKS, Schedule};
use session::{MAX_LATE_TICKS, Session};
use setup::Setup;
use state::{FlashJob, State};

pub use outbox::Outbox;
pub use state::FlashTask;

/// A board without its chip. The [module's front page](self) draws its states.
#[derive(Debug)]
pub struct Board {
    session: Session,
    setup: Setup,
    state: State,
    servo: Servo,
    planner: Planner,
    schedule: Schedule,
}

/// What the chip carries out besides the pulses, from the next tick on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tick {
    /// Whether the drivers hold the motors: with a configuration, from the first matching Hello on,
    /// since motors without current drop the ball; but not after an emergency stop or a restart for
    /// an error of the board itself. A restart takes the current and drops the ball, so that a
    /// stored configuration waits for the Hello too.
    pub drivers_enabled: bool,
    /// Restart into the bootloader now; the motors stand still.
    pub bootloader: bool,
    /// Write wiring and configuration ([`Board::wiring`], [`Board::config`]), or test the flash,
    /// now and report the result ([`Board::on_stored`]); the motors stand still.
    pub flash: Option<FlashTask>,
    /// Report the chip's counts ([`Board::on_diagnosed`]).
    pub diagnose: bool,
    /// Report a measurement ([`Board::on_measured`]).
    pub measure: bool,
    /// Set up the motor drivers over their UART, unless that is under way, and report the result
    /// ([`Board::on_drivers_ready`], [`Board::on_driver_failure`]); the motors stand still.
    pub set_up_drivers: bool,
}

impl Board {
    /// Creates a board that has just started.
    pub fn new(build: BuildLimits) -> Self {
        Self {
            session: Session::new(),
            setup: Setup::new(build),
            state: State::Unconfigured,
            servo: Servo::new(None),
            planner: Planner::default(),
            schedule: Schedule::new(),
        }
    }

    /// Sets the cause of the start; call before the first tick. After a restart for an error of the
    /// board itself the motors' positions are unknown, and the board begins in a fault.
    pub fn set_start_cause(&mut self, cause: StartCause) {
        self.session.start_cause = cause;
        if matches!(cause, StartCause::Watchdog | StartCause::Panic(_) | StartCause::HardFault) {
            self.state = self.state.faulted(Fault::Watchdog);
        }
    }

    /// Has the board refuse to drive until its next start, because its chip's clock is not the one
    /// that it plans with; call before the first tick.
    #[cold]
    pub fn refuse_clock(&mut self) {
        self.state = self.state.faulted(Fault::Clock);
    }

    /// Sets what the board tells of its program and chip; call before the first tick. Without a
    /// call that is [`Provenance::EMULATED`].
    pub fn set_provenance(&mut self, provenance: Provenance) {
        self.session.provenance = provenance;
    }

    /// Applies a wiring and a configuration that were stored in flash; call before the first tick.
    /// The motors have no current until a host's Hello has matched. Where either is out of range
    /// for this board, both are ignored.
    pub fn restore(&mut self, wiring: &Wiring, config: &Config) {
        if let Ok(params) = self.setup.check(wiring, config) {
            self.apply_config(params, wiring);
        }
    }

    /// Returns the wiring in force.
    pub fn wiring(&self) -> Option<&Wiring> {
        self.setup.wiring()
    }

    /// Returns the configuration in force.
    pub fn config(&self) -> Option<&Config> {
        self.setup.config()
    }

    /// Returns the number of configurations since the start; wraps.
    pub fn generation(&self) -> u32 {
        self.setup.generation()
    }

    /// Returns the number of changes of the wiring or the microsteps since the start; wraps. With
    /// each, pins and drivers are set up anew; other configurations leave them as they are.
    pub fn wiring_generation(&self) -> u32 {
        self.setup.wiring_generation()
    }

    /// Returns the step generator's timing for the configured drivers.
    pub fn driver_timing(&self) -> Option<DriverTiming> {
        self.setup.params().map(|params| params.timing)
    }

    /// Returns the state as telemetry names it.
    pub fn state(&self) -> message::State {
        self.state.on_wire()
    }

    /// Returns the motor positions at the end of the last tick, 1/16 steps since the start.
    pub fn positions(&self) -> PerMotor<i32> {
        self.planner.positions()
    }

    /// Returns the motor positions at the end of the last tick, 1/16 steps from the zero of travel.
    pub fn travel_positions(&self) -> PerMotor<i32> {
        let (positions, zero) = (self.positions(), self.planner.zero());
        per_motor(|i| positions[i] - zero[i])
    }

    /// Returns the motor rates during the last tick, Q8 steps/s.
    pub fn rates(&self) -> PerMotor<i32> {
        self.planner.rates()
    }

    /// Returns `values` for the motors of the rig, or for all without a configuration.
    fn of_motors<T: Copy>(&self, values: PerMotor<T>) -> MotorList<T> {
        match self.setup.params() {
            Some(params) => params.of_motors(values),
            None => MotorList::new(values),
        }
    }

    /// Returns the pulses of the tick that was planned last.
    #[inline]
    pub fn pulses(&self) -> &StepPlan {
        self.planner.plan()
    }
}

/// Events.
impl Board {
    /// Takes in a frame that arrived at `now`. Answers go to `out`.
    #[inline(never)]
    pub fn on_frame(&mut self, now: Micros, frame: Result<&Request, FrameError>, out: &mut Outbox) {
        match frame {
            Ok(request) => {
                self.schedule.dirty = true;
                self.on_command(now, request, out);
            }
            Err(error) => {
                self.session.bad_frames = self.session.bad_frames.saturating_add(1);
                if let FrameError::UnknownCommand { id } = error {
                    out.answer(now, id, Err(Refusal::Malformed));
                }
            }
        }
    }

    /// Takes in the result of [`Tick::flash`]: whether the flash was written.
    pub fn on_stored(&mut self, now: Micros, written: bool, out: &mut Outbox) {
        self.schedule.dirty = true;
        let Some(FlashJob { request, .. }) = self.state.flash_job() else { return };
        self.state = self.state.stored();
        if !written {
            // A repetition tries again.
            self.session.last_request.take_if(|last| *last == request);
        }
        out.answer(now, request.id, if written { Ok(()) } else { Err(Refusal::NotStored) });
    }

    /// Takes in the chip's counts, for [`Tick::diagnose`], and reports them.
    pub fn on_diagnosed(&mut self, chip: ChipCounts, out: &mut Outbox) {
        let Some(id) = self.session.diagnosis.take() else { return };
        self.schedule.dirty = true;
        let Session { start_cause: start, bad_frames, .. } = self.session;
        out.send(&FromBoard::Diagnostics(Diagnostics { id, start, bad_frames, chip }));
    }

    /// Takes in what the chip has measured, for [`Tick::measure`], and reports it; `None` from a
    /// chip that cannot measure.
    pub fn on_measured(&mut self, now: Micros, chip: Option<ChipMeasurement>, out: &mut Outbox) {
        let Some(id) = self.session.measurement.take() else { return };
        self.schedule.dirty = true;
        match chip {
            Some(chip) => out.send(&FromBoard::Measurement(Measurement { id, chip })),
            None => out.answer(now, id, Err(Refusal::Unsupported)),
        }
    }

    /// Takes in the law worker's response, which takes effect in its tick. A response that is not
    /// there by then stops the board.
    #[inline(never)]
    pub fn on_law_response(&mut self, response: &LawResponse) {
        self.servo.on_response(response);
    }

    /// Stops the board because a motor driver failed: the motor positions are unknown. Call this in
    /// every tick as long as a Motor HAT does not answer, and once for a driver on a UART, which is
    /// set up again once the board is in no fault, this one or another.
    #[inline(never)]
    pub fn on_driver_failure(&mut self, now: Micros, fault: DriverFault, out: &mut Outbox) {
        let has_uart = self.setup.wiring().is_some_and(|wiring| wiring.drivers.tmc2209().is_some());
        if has_uart && self.schedule.driver_setup == DriverSetup::Done {
            self.schedule.driver_setup = DriverSetup::Again;
        }
        self.fault(now, Fault::Driver(fault), out);
    }

    /// Takes in that a tick came late while motors turned, which delayed the pulses. More than
    /// ten within a second stop the board.
    #[inline(never)]
    pub fn on_late_tick(&mut self, now: Micros, out: &mut Outbox) {
        if self.session.count_late_tick(now) > MAX_LATE_TICKS {
            self.fault(now, Fault::LateTicks, out);
        }
    }

    /// Takes in that the drivers on a UART are set up, for [`Tick::set_up_drivers`]. They get
    /// current, and the motors move where a command waits for that.
    #[inline(never)]
    pub fn on_drivers_ready(&mut self) {
        self.schedule.driver_setup = DriverSetup::Done;
        self.schedule.dirty = true;
    }

    /// Reports readings of drivers on a UART to a host that was greeted.
    #[inline(never)]
    pub fn on_driver_readings(
        &mut self,
        now: Micros,
        motors: PerMotor<DriverReading>,
        out: &mut Outbox,
    ) {
        if self.session.greeted {
            let motors = self.of_motors(motors);
            out.send(&FromBoard::Drivers(DriverReport { time: now, motors }));
        }
    }

    /// Stops the board for the emergency input. The hardware has stopped the pulses: each motor is
    /// `missing` pulses short of its planned position (+ if the direction line is high). The
    /// drivers are switched off and the fault is latched. Call this before every tick as long as
    /// the input is open, so that the fault cannot be cleared.
    #[inline(never)]
    pub fn on_emergency_stop(&mut self, now: Micros, missing: PerMotor<i32>, out: &mut Outbox) {
        self.schedule.emergency_ticks = EMERGENCY_TICKS;
        self.schedule.dirty = true;
        self.planner.cut(missing);
        if self.state() != message::State::Fault(Fault::EmergencyStop) {
            self.enter_fault(now, Fault::EmergencyStop, out);
        }
    }
}

/// Faults and telemetry.
impl Board {
    /// Stops the board for `fault`, unless it is in a fault: the first one stays.
    #[inline(never)]
    pub(super) fn fault(&mut self, now: Micros, fault: Fault, out: &mut Outbox) {
        if !matches!(self.state, State::Fault { .. }) {
            self.enter_fault(now, fault, out);
        }
    }

    /// Enters the fault and reports it.
    fn enter_fault(&mut self, now: Micros, fault: Fault, out: &mut Outbox) {
        self.state = self.state.faulted(fault);
        self.schedule.dirty = true;
        out.send(&FromBoard::Fault(FaultReport {
            time: now,
            fault,
            configuration: self.session.configuration,
        }));
        self.send_telemetry(now, out);
    }

    #[inline(never)]
    fn send_telemetry(&mut self, now: Micros, out: &mut Outbox) {
        self.session.last_telemetry = now;
        self.schedule.telemetry_due = false;
        let goal = self.state.goal();
        let (error, filtered_error) =
            goal.map_or(([0; 3], 0), |goal| self.servo.errors(goal.target));
        out.send(&FromBoard::Telemetry(Telemetry {
            time: now,
            state: self.state(),
            configuration: self.session.configuration,
            target: goal.and_then(|goal| goal.command),
            sequence: self.session.sequence,
            motors: self.of_motors(self.travel_positions().map(Steps16)),
            rates: self.of_motors(self.rates().map(Rate)),
            error: Point(error.map(Micrometres)),
            filtered_error: Micrometres(filtered_error as i32),
            bad_frames: self.session.bad_frames,
            tensions: goal.and_then(|_| self.servo.tensions()).map(|it| self.of_motors(it)),
            reference: goal.and_then(|_| self.servo.reference_state(now)),
            late_ticks: self.session.late_ticks,
        }));
    }
}
