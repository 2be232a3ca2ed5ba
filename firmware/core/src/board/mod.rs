//! The board: what it does with the bytes and the time that it is given.

mod commands;
mod guards;
mod outbox;
mod seek;

use plumb_protocol::frame::{Accumulator, FrameError};
use plumb_protocol::message::{Answer, Fault, FaultReport, FromBoard, Refusal, State, Telemetry, ToBoard};
use plumb_protocol::units::{Micrometres, Micros, Point, Rate, Steps16};

use crate::estimate;
use crate::law::MotorRates;
use crate::params::{BuildLimits, Params};
use crate::plan::{Jogging, Planner, StepPlan};
pub use outbox::Outbox;
use seek::{Seek, Sight};

/// Telemetry comes at least this often once a host was greeted.
const TELEMETRY_US: u64 = 100_000;

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
    activity: Activity,
    planner: Planner,
    sight: Sight,
    /// When the last intact command came.
    heard: Micros,
    /// When telemetry was sent last.
    told: Micros,
    bootloader: bool,
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tick {
    /// The pulses.
    pub plan: StepPlan,
    /// Whether the drivers hold the motors: from the first configuration on, since motors without current drop the
    /// ball.
    pub drivers_enabled: bool,
    /// Restart into the bootloader now; the motors stand still.
    pub bootloader: bool,
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
            activity: Activity::Idle,
            planner: Planner::default(),
            sight: Sight::default(),
            heard: Micros(0),
            told: Micros(0),
            bootloader: false,
        }
    }

    /// Takes in bytes that arrived at `now`, in any pieces; answers go to `out`.
    pub fn receive(&mut self, now: Micros, bytes: &[u8], out: &mut Outbox) {
        for &byte in bytes {
            match self.accumulator.push::<ToBoard>(byte) {
                None => {}
                Some(Ok(message)) => self.handle(now, message, out),
                Some(Err(error)) => {
                    self.bad_frames = self.bad_frames.saturating_add(1);
                    if error == FrameError::Malformed {
                        answer(out, 0, Err(Refusal::Malformed));
                    }
                }
            }
        }
    }

    /// Plans the tick that begins at `now`; call every [`TICK_US`](crate::plan::TICK_US).
    pub fn tick(&mut self, now: Micros, out: &mut Outbox) -> Tick {
        if let Some(fault) = self.expired(now) {
            self.fault(now, fault, out);
        }
        let wanted = self.wanted(now);
        let (plan, beyond) = self.planner.tick(wanted);
        if let Some(motor) = beyond {
            self.fault(now, Fault::Travel(motor as u8), out);
        }
        if self.greeted && now.since(self.told) >= TELEMETRY_US {
            self.tell(now, out);
        }
        Tick {
            plan,
            drivers_enabled: self.params.is_some(),
            bootloader: self.bootloader && !self.planner.moving(),
        }
    }

    /// The state, as it is told to the host.
    pub fn state(&self) -> State {
        match (self.params, self.activity) {
            (_, Activity::Faulted(fault)) => State::Fault(fault),
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

    /// The rates that the present activity asks for; a jog that has arrived ends.
    fn wanted(&mut self, now: Micros) -> MotorRates {
        match &self.activity {
            Activity::Idle | Activity::Faulted(_) => MotorRates::default(),
            Activity::Jogging(jogging) => jogging.wanted(&self.planner).unwrap_or_else(|| {
                self.activity = Activity::Idle;
                MotorRates::default()
            }),
            Activity::Seeking(seek) if self.coasting(now) => seek.rates.coasting(),
            Activity::Seeking(seek) => seek.rates,
        }
    }

    /// Stops for `fault`, unless the board has stopped already: the first reason stays.
    fn fault(&mut self, now: Micros, fault: Fault, out: &mut Outbox) {
        if matches!(self.activity, Activity::Faulted(_)) {
            return;
        }
        self.activity = Activity::Faulted(fault);
        out.send(&FromBoard::Fault(FaultReport { time: now, fault }));
        self.tell(now, out);
    }

    /// Sends telemetry.
    fn tell(&mut self, now: Micros, out: &mut Outbox) {
        self.told = now;
        let (error, filtered) = match &self.activity {
            Activity::Seeking(seek) => (
                self.sight.last.map_or([0; 3], |last| estimate::error(last, seek.target)),
                self.sight.filtered_error(seek.target).unwrap_or(0),
            ),
            _ => ([0; 3], 0),
        };
        out.send(&FromBoard::Telemetry(Telemetry {
            time: now,
            state: self.state(),
            sequence: self.sight.sequence,
            motors: self.positions().map(Steps16),
            rates: self.rates().map(Rate),
            error: Point(error.map(Micrometres)),
            filtered_error: Micrometres(filtered as i32),
            bad_frames: self.bad_frames,
        }));
    }
}

/// Answers command `id`.
fn answer(out: &mut Outbox, id: u16, result: Result<(), Refusal>) {
    out.send(&FromBoard::Answer(Answer { id, refusal: result.err() }));
}
