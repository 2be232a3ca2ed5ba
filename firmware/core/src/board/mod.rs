//! The board: what it does with the bytes and the time that it is given.

mod commands;
mod guards;
mod outbox;
mod requests;
mod seek;

use plumb_protocol::config::{Config, Drivers};
use plumb_protocol::frame::{self, Accumulator, FrameError};
use plumb_protocol::message::{
    Answer, Fault, FaultReport, FromBoard, Refusal, StartCause, State, Telemetry, ToBoard,
};
use plumb_protocol::units::{Micrometres, Micros, Point, Rate, Steps16};

use crate::driver_timing::DriverTiming;
use crate::estimate;
use crate::law::{MotorRates, Setpoint};
use crate::law_worker::{LawClient, LawRequest, LawResponse, LawWorker};
use crate::params::{BuildLimits, Params};
use crate::plan::{Jogging, Planner, StepPlan};
pub use outbox::Outbox;
use requests::LastRequest;
use seek::{Guards, Seek, Sight};

/// Telemetry comes at least this often once a host was greeted.
const TELEMETRY_US: u64 = 100_000;

/// Ticks from the last report of an open emergency input until it counts as closed: the tick that
/// the report precedes, and one that no report precedes.
const EMERGENCY_TICKS: u8 = 2;

/// A board without its chip. States and transitions:
///
/// ```text
/// Unconfigured -Configure-> Ready -Target-> Seeking -reached-> Holding -Target-> Seeking
///                           Ready -Hold-> Holding;  Seeking, Holding -Stop-> Ready
///                           any -guard-> Fault -ClearFault-> Ready
/// ```
#[derive(Debug)]
pub struct Board {
    build: BuildLimits,
    accumulator: Accumulator,
    bad_frames: u16,
    greeted: bool,
    params: Option<Params>,
    /// What the parameters were made from.
    config: Option<Config>,
    generation: u32,
    /// Id of the Configure command of this session that made it.
    configuration: Option<u16>,
    start_cause: StartCause,
    last_request: Option<LastRequest>,
    /// The command that waits for the configuration to be written.
    storing: Option<u16>,
    /// Ticks to be planned until the emergency input counts as closed.
    emergency_ticks: u8,
    activity: Activity,
    /// Guards of the present drive, or the last one.
    guards: Guards,
    planner: Planner,
    sight: Sight,
    law_client: LawClient,
    /// When the last intact command came.
    last_rx: Micros,
    /// When telemetry was sent last.
    last_telemetry: Micros,
    /// Whether it is to be sent after this tick.
    telemetry_due: bool,
    bootloader: bool,
    /// Whether a picture was taken in that is still to be judged by.
    progress_due: bool,
    /// Whether something has happened that the coming tick is to look at.
    dirty: bool,
    /// Ticks until one that is to look at what time has brought.
    idle_ticks: u32,
}

/// What the board is at.
#[derive(Debug, Clone, Copy)]
enum Activity {
    /// Nothing: ramping down or at rest.
    Idle,
    /// Turning one motor.
    Jogging(Jogging),
    /// Driving the ball to a target, or keeping it there.
    Seeking(Seek),
    /// Stopped by itself.
    Faulted(Fault),
}

/// What the chip carries out for the next tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tick {
    /// Whether the drivers hold the motors: from the first configuration on, since motors without
    /// current drop the ball; but not after an emergency stop or a restart for a mistake of the
    /// board's own.
    pub drivers_enabled: bool,
    /// Restart into the bootloader now; the motors stand still.
    pub bootloader: bool,
    /// Write the configuration now ([`Board::config`]) and say how that went ([`Board::on_stored`]);
    /// the motors stand still.
    pub store: bool,
}

impl Board {
    /// A board that has just started.
    pub fn new(build: BuildLimits) -> Self {
        Self {
            build,
            accumulator: Accumulator::new(),
            bad_frames: 0,
            greeted: false,
            params: None,
            config: None,
            generation: 0,
            configuration: None,
            start_cause: StartCause::PowerOn,
            last_request: None,
            storing: None,
            emergency_ticks: 0,
            activity: Activity::Idle,
            guards: Guards::new(Micros(0)),
            planner: Planner::default(),
            sight: Sight::default(),
            law_client: LawClient::default(),
            last_rx: Micros(0),
            last_telemetry: Micros(0),
            telemetry_due: false,
            bootloader: false,
            progress_due: false,
            dirty: true,
            idle_ticks: 0,
        }
    }

    /// Says why the board has started; before its first tick. What the motors did meanwhile is not
    /// known where it was for a mistake of its own, and the board begins stopped.
    pub fn set_start_cause(&mut self, cause: StartCause) {
        self.start_cause = cause;
        if matches!(cause, StartCause::Watchdog | StartCause::Panic | StartCause::HardFault) {
            self.activity = Activity::Faulted(Fault::Watchdog);
        }
    }

    /// Takes up a configuration that was kept over a loss of power; before the first tick. Nothing
    /// moves until a host's Hello has matched. One that is out of range for this board is ignored.
    pub fn restore(&mut self, config: &Config) {
        if let Ok(params) = Params::check(config, &self.build) {
            self.apply_config(params, config);
        }
    }

    /// The present configuration.
    pub fn config(&self) -> Option<&Config> {
        self.config.as_ref()
    }

    /// How often the board has been configured.
    pub fn generation(&self) -> u32 {
        self.generation
    }

    /// What turns the motors; `None` before the first configuration.
    pub fn drivers(&self) -> Option<Drivers> {
        self.params.as_ref().map(|p| p.drivers)
    }

    /// Returns the step generator's timing for the configured drivers.
    pub fn driver_timing(&self) -> Option<DriverTiming> {
        self.params.as_ref().map(|p| p.timing)
    }

    /// Answers to [`Tick::store`]: whether the configuration was written, as known at `now`.
    pub fn on_stored(&mut self, now: Micros, written: bool, out: &mut Outbox) {
        self.dirty = true;
        if let Some(id) = self.storing.take() {
            if !written {
                // A repetition tries again.
                self.last_request.take_if(|last| last.is_store(id));
            }
            answer(now, out, id, if written { Ok(()) } else { Err(Refusal::NotStored) });
        }
    }

    /// Takes in bytes that arrived at `now`, in any pieces; answers go to `out`.
    pub fn receive(&mut self, now: Micros, mut bytes: &[u8], out: &mut Outbox) {
        while !bytes.is_empty() {
            let message =
                self.accumulator.take(&mut bytes).map(|message| message.and_then(frame::read));
            if let Some(message) = &message {
                self.on_frame(now, message.as_ref().map_err(|error| *error), out);
            }
        }
    }

    /// Takes in what a frame that arrived at `now` has turned out to be, for who looks for the
    /// frames himself.
    #[inline(never)]
    pub fn on_frame(
        &mut self,
        now: Micros,
        message: Result<&ToBoard, FrameError>,
        out: &mut Outbox,
    ) {
        match message {
            Ok(message) => {
                self.dirty = true;
                self.on_command(now, message, out);
            }
            Err(error) => {
                self.bad_frames = self.bad_frames.saturating_add(1);
                if error == FrameError::Malformed {
                    answer(now, out, 0, Err(Refusal::Malformed));
                }
            }
        }
    }

    /// Plans the tick that begins at `now`, and says what there is to say; call every
    /// [`TICK_US`](crate::clock::TICK_US). This is [`plan`](Self::plan) and
    /// [`report`](Self::report), with a `thinker` of the board's own that answers at once: for
    /// hosts, whose time does not pass meanwhile.
    pub fn tick(
        &mut self,
        now: Micros,
        law_worker: &mut LawWorker,
        out: &mut Outbox,
    ) -> Option<Tick> {
        let tick = self.plan(now, out);
        self.report(now, out);
        if let Some(question) = self.take_law_request() {
            self.on_law_response(&law_worker.respond(&question));
        }
        tick
    }

    /// The first half of a tick: its [pulses](Self::pulses), and what else is to be carried out
    /// where that may have changed. A chip has that in hand before it goes on to the second.
    #[inline]
    pub fn plan(&mut self, now: Micros, out: &mut Outbox) -> Option<Tick> {
        if self.dirty || self.idle_ticks == 0 {
            return Some(self.run_due(now, out));
        }
        self.idle_ticks -= 1;
        self.plan_pulses(now, out);
        None
    }

    /// Plans the pulses.
    #[inline(always)]
    fn plan_pulses(&mut self, now: Micros, out: &mut Outbox) {
        if let Some(motor) = self.planner.plan_tick() {
            self.fault(now, Fault::Travel(motor as u8), out);
        }
    }

    /// What the motors do in the tick that was planned last.
    #[inline]
    pub fn pulses(&self) -> &StepPlan {
        self.planner.plan()
    }

    /// The second half: how things go, what a slow law is to be asked, telemetry after a position
    /// and from time to time, and what to wait for.
    #[inline]
    pub fn report(&mut self, now: Micros, out: &mut Outbox) {
        self.planner.follow_up();
        if self.progress_due {
            self.check_progress(now, out);
        }
        if self.idle_ticks == 0 {
            self.idle_ticks = self.ticks_to_deadline(now);
        }
        if self.law_client.has_pending() {
            self.ask(now);
        }
        if self.telemetry_due {
            self.send_telemetry(now, out);
        }
    }

    /// A tick that looks at what has happened and at what is due. One in which neither is needs
    /// nothing of this.
    #[inline(never)]
    fn run_due(&mut self, now: Micros, out: &mut Outbox) -> Tick {
        // Until then nothing is, whatever else there is to look at.
        let due = self.idle_ticks == 0;
        if due && let Some(fault) = self.expired(now) {
            self.fault(now, fault, out);
        }
        self.take_answer(now, out);
        let wanted = self.wanted(now);
        self.planner.aim(wanted.rates, wanted.ramp_us);
        self.telemetry_due |= due && self.greeted && now.since(self.last_telemetry) >= TELEMETRY_US;
        let off =
            matches!(self.activity, Activity::Faulted(Fault::EmergencyStop | Fault::Watchdog));
        self.emergency_ticks = self.emergency_ticks.saturating_sub(1);
        (self.dirty, self.idle_ticks) = (self.emergency_ticks > 0, 0);
        self.plan_pulses(now, out);
        Tick {
            drivers_enabled: self.params.is_some() && !off,
            bootloader: self.bootloader && self.storing.is_none() && !self.planner.moving(),
            store: self.storing.is_some(),
        }
    }

    /// The question to a slow law that has come up, if any, for a [`LawWorker`]; once. To be looked
    /// for after every [`report`](Self::report).
    #[inline]
    pub fn take_law_request(&mut self) -> Option<LawRequest> {
        self.law_client.take_request()
    }

    /// A thinker's answer is there; it takes effect in its tick. One that is not there by then
    /// stops the board.
    #[inline(never)]
    pub fn on_law_response(&mut self, answer: &LawResponse) {
        self.law_client.on_response(answer);
    }

    /// The emergency input has cut the pulses off: the motors stand, `missing` pulses each from
    /// where they were planned to be (+ where the direction line is high), and the drivers are let
    /// go. Latched like any fault; to be called before every tick for as long as the input is open,
    /// so that clearing it is refused.
    #[inline(never)]
    pub fn on_emergency_stop(&mut self, now: Micros, missing: [i32; 3], out: &mut Outbox) {
        self.emergency_ticks = EMERGENCY_TICKS;
        self.dirty = true;
        self.planner.cut(missing);
        if !matches!(self.activity, Activity::Faulted(Fault::EmergencyStop)) {
            self.activity = Activity::Idle;
            self.fault(now, Fault::EmergencyStop, out);
        }
    }

    /// The state, as the host reads it.
    pub fn state(&self) -> State {
        match (&self.params, &self.activity) {
            (_, Activity::Faulted(fault)) => State::Fault(*fault),
            (None, _) => State::Unconfigured,
            (_, Activity::Seeking(seek)) if seek.reached => State::Holding,
            (_, Activity::Seeking(_)) => State::Seeking,
            (_, Activity::Idle | Activity::Jogging(_)) => State::Ready,
        }
    }

    /// Motor positions in 1/16 steps since the start, to the end of the last tick.
    pub fn positions(&self) -> [i32; 3] {
        self.planner.positions()
    }

    /// Motor rates in Q8 steps/s during the last tick.
    pub fn rates(&self) -> [i32; 3] {
        self.planner.rates()
    }

    /// Makes a question of what was seen, if something is sought.
    #[inline(never)]
    fn ask(&mut self, now: Micros) {
        let (Activity::Seeking(seek), Some(params)) = (&mut self.activity, &self.params) else {
            return self.law_client.discard_pending();
        };
        if let Some(number) = self.law_client.make_request(now, seek.target, &self.planner, params)
        {
            seek.question = Some(number);
            // The tick in which the answer takes effect is looked at.
            self.idle_ticks = self.idle_ticks.min(self.law_client.ticks_to_due(now));
        }
    }

    /// Goes by the answer that takes effect at `now`, if it is still asked for.
    fn take_answer(&mut self, now: Micros, out: &mut Outbox) {
        let Some((number, setpoint)) = self.law_client.take_due(now) else { return };
        let (Activity::Seeking(seek), Some(params)) = (&mut self.activity, &self.params) else {
            return;
        };
        if seek.question.take_if(|asked| *asked == number).is_none() {
            return;
        }
        match setpoint {
            Some(setpoint) => seek.follow(now, setpoint, params),
            None => self.fault(now, Fault::LawLate, out),
        }
    }

    /// What the present activity asks for; a jog that has arrived ends.
    fn wanted(&mut self, now: Micros) -> Setpoint {
        match &self.activity {
            Activity::Idle | Activity::Faulted(_) => Setpoint::default(),
            Activity::Jogging(jogging) => {
                Setpoint::at_once(jogging.wanted(&self.planner).unwrap_or_else(|| {
                    self.activity = Activity::Idle;
                    MotorRates::default()
                }))
            }
            Activity::Seeking(seek) => match self.coasting(now) {
                Some(since) => {
                    let setpoint = seek.setpoint(since);
                    Setpoint { rates: setpoint.rates.coasting(), ..setpoint }
                }
                None => seek.setpoint(now),
            },
        }
    }

    /// Stops for `fault`, unless the board has stopped already: the first reason stays.
    #[inline(never)]
    fn fault(&mut self, now: Micros, fault: Fault, out: &mut Outbox) {
        if matches!(self.activity, Activity::Faulted(_)) {
            return;
        }
        self.activity = Activity::Faulted(fault);
        self.dirty = true;
        out.send(&FromBoard::Fault(FaultReport {
            time: now,
            fault,
            configuration: self.configuration,
        }));
        self.send_telemetry(now, out);
    }

    /// Sends telemetry.
    #[inline(never)]
    fn send_telemetry(&mut self, now: Micros, out: &mut Outbox) {
        self.last_telemetry = now;
        self.telemetry_due = false;
        let (target, error, filtered) = match &self.activity {
            Activity::Seeking(seek) => (
                seek.command,
                self.sight.last.map_or([0; 3], |last| estimate::error(last, seek.target)),
                self.sight.filtered_error(seek.target).unwrap_or(0),
            ),
            _ => (None, [0; 3], 0),
        };
        out.send(&FromBoard::Telemetry(Telemetry {
            time: now,
            state: self.state(),
            configuration: self.configuration,
            target,
            sequence: self.sight.sequence,
            motors: self.positions().map(Steps16),
            rates: self.rates().map(Rate),
            error: Point(error.map(Micrometres)),
            filtered_error: Micrometres(filtered as i32),
            bad_frames: self.bad_frames,
        }));
    }
}

/// Answers command `id` at `now`.
fn answer(now: Micros, out: &mut Outbox, id: u16, result: Result<(), Refusal>) {
    out.send(&FromBoard::Answer(Answer { id, refusal: result.err(), time: now }));
}
