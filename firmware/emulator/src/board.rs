//! Board in virtual time: bytes in and out, a clock that the caller advances, and a plant that the
//! board's steps move. Drivers on a UART are emulated with their registers. Samples of the motor
//! positions are taken at even intervals.

mod driver_uart;
mod hold;
mod sampler;

use std::ops::Range;

use nalgebra::Point3;
use plumb_core::law::LawTicks;
use plumb_core::params::Params;
use plumb_core::tmc2209::Event;
use plumb_core::{Board, BuildLimits, TICK_US, Tick};
use plumb_protocol::diagnostics::ChipCounts;
use plumb_protocol::message::{DriverFault, Refusal, StartCause, State};
use plumb_protocol::units::Micros;
use plumb_protocol::{Config, MOTORS, PerMotor, Wiring};

use crate::harness::{Harness, LawDelay};
use crate::plant::{Plant, RigError};
use crate::wire::{Link, Traffic, Wire};
use driver_uart::DriverUart;
use hold::Hold;
use sampler::Sampler;

pub use driver_uart::DriverTrouble;
pub use sampler::MotorSample;

/// Limits of an emulated board: the pulse rate of the Pico's firmware, no storage, any kind of
/// board, and laws that respond as on an RP2040.
pub const EMULATED: BuildLimits = BuildLimits {
    max_pulse_rate: 1_250_000,
    storage: false,
    chip: None,
    law_ticks: LawTicks::RP2040,
};

/// Largest number of bytes that wait for the host. Beyond it the oldest are dropped, as on a link
/// that no host reads.
const WAITING_BYTES_MAX: usize = 1 << 16;

/// Emulated board. Its time passes only in [`run_to`](Self::run_to).
pub struct EmulatedBoard {
    harness: Harness,
    plant: Option<Box<dyn Plant + Send>>,
    /// Which motors of the rig hold their cables.
    hold: Hold,
    /// Positions of the rig's motors at the board's last start, full steps since the rig's start.
    origin: PerMotor<f64>,
    /// Link between the host and the board; `None` for a direct connection.
    link: Option<Link>,
    now: Micros,
    waiting: Vec<u8>,
    /// What the board asked of its chip in the last tick.
    requests: Option<Tick>,
    /// Samples of the motor positions, where they are asked for.
    sampler: Option<Sampler>,
    /// When the emergency input is open by a plan.
    emergency: Range<Micros>,
    /// Drivers on a UART, where the configuration has some.
    drivers: Option<DriverUart>,
    /// The board's wiring generation that has these drivers.
    generation: u32,
    /// Trouble of a driver by a plan.
    trouble: Option<DriverTrouble>,
}

impl EmulatedBoard {
    /// Creates a board without a rig.
    pub fn new(build: BuildLimits) -> Self {
        let mut harness = Harness::new(build, LawDelay::SameTick);
        harness.sets_up_drivers = false;
        Self {
            harness,
            plant: None,
            hold: Hold::default(),
            origin: [0.0; MOTORS],
            link: None,
            now: Micros(0),
            waiting: Vec::new(),
            requests: None,
            sampler: None,
            emergency: Micros(0)..Micros(0),
            drivers: None,
            generation: 0,
            trouble: None,
        }
    }

    /// Returns every reason for which an emulated board refuses `wiring`, and `config` with it. The
    /// firmware of the board that `wiring` names refuses the same.
    pub fn refusals(wiring: &Wiring, config: &Config) -> Vec<Refusal> {
        let mut refusals = Vec::new();
        wiring.each_error(EMULATED.chip, |error| refusals.push(Refusal::Wiring(error)));
        let drivers = &wiring.drivers;
        Params::each_error(config, drivers, &EMULATED, |f| refusals.push(Refusal::Config(f)));
        refusals
    }

    /// Creates a board whose motors move `plant`.
    pub fn with_plant(build: BuildLimits, plant: Box<dyn Plant + Send>) -> Self {
        Self { plant: Some(plant), ..Self::new(build) }
    }

    /// Puts `wire` between the host and this board.
    #[must_use]
    pub fn with_wire(mut self, wire: Wire) -> Self {
        self.set_wire(wire);
        self
    }

    /// Replaces the link between the host and this board. Frames on the old link are lost. Reboots
    /// whose time has passed happen in the next tick.
    pub fn set_wire(&mut self, wire: Wire) {
        self.link = Some(Link::new(wire));
    }

    /// Returns the traffic of the link towards the board and towards the host; `None` without a
    /// [`Wire`].
    pub fn traffic(&self) -> Option<[Traffic; 2]> {
        self.link.as_ref().map(|link| [link.to_board.traffic(), link.to_host.traffic()])
    }

    /// Returns the time on the board's clock.
    pub fn now(&self) -> Micros {
        self.now
    }

    /// Sends `bytes` from the host now. Without a wire they arrive at the board at once.
    pub fn write(&mut self, bytes: &[u8]) {
        match &mut self.link {
            None => self.harness.receive(self.now, bytes),
            Some(link) => {
                link.to_board.send(self.now, bytes);
                self.deliver();
            }
        }
        self.collect();
    }

    /// Returns the bytes that have arrived at the host since the last call.
    pub fn read(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.waiting)
    }

    /// Advances the board's time in whole ticks. The last tick ends at `end` or before it.
    ///
    /// # Errors
    /// If the rig cannot follow its motors. The board's time is then the end of that tick.
    pub fn run_to(&mut self, end: Micros) -> Result<(), RigError> {
        while self.now.0 + u64::from(TICK_US) <= end.0 {
            self.restart_if_due();
            self.deliver();
            // Without a configuration the board does not know the pin of the input.
            let is_watched = self.state() != State::Unconfigured;
            if is_watched && self.emergency.contains(&self.now) {
                self.open_emergency([0; MOTORS]);
            }
            self.run_drivers();
            // Only hardware needs the step plan. The rig follows the board's positions, which
            // count the same pulses.
            self.requests = self.harness.tick(self.now);
            let asked = self.requests.unwrap_or_default();
            if let Some(asked) = self.requests {
                self.hold.enabled = asked.drivers_enabled;
            }
            if asked.diagnose {
                self.harness.on_diagnosed(ChipCounts::default());
            }
            if asked.measure {
                self.harness.on_measured(self.now, None);
            }
            if let Some(drivers) = self.drivers.as_mut().filter(|_| asked.set_up_drivers) {
                drivers.request_set_up();
            }
            self.now.0 += u64::from(TICK_US);
            self.collect();
            if asked.bootloader {
                // It has no bootloader that could wait for a program, and begins its own again.
                self.restart(StartCause::Requested);
            }
            let motors = self.rig_motors();
            if let Some(sampler) = &mut self.sampler {
                sampler.note(self.now, motors);
            }
            if let Some(plant) = &mut self.plant {
                let currents = self.drivers.as_ref().map(DriverUart::currents);
                self.hold.advance(currents, plant.as_mut());
                plant.advance(f64::from(TICK_US) * 1e-6, motors)?;
            }
        }
        Ok(())
    }

    /// Does the same, and stops in the tick in which bytes arrive at the host. Returns whether some
    /// have arrived that were not [read](Self::read).
    ///
    /// # Errors
    /// As [`run_to`](Self::run_to).
    pub fn run_until_bytes(&mut self, end: Micros) -> Result<bool, RigError> {
        while self.waiting.is_empty() && self.now.0 + u64::from(TICK_US) <= end.0 {
            self.run_to(Micros(self.now.0 + u64::from(TICK_US)))?;
        }
        Ok(!self.waiting.is_empty())
    }

    /// Runs the drivers on a UART to the present tick, and passes what they tell to the board.
    fn run_drivers(&mut self) {
        let core = &self.harness.board;
        if core.wiring_generation() != self.generation {
            self.generation = core.wiring_generation();
            self.drivers = DriverUart::of(core, self.now);
        }
        let Some(drivers) = &mut self.drivers else { return };
        match drivers.advance(self.now, core.rates(), self.trouble.as_ref()) {
            None => {}
            Some(Event::Ready) => self.harness.on_drivers_ready(),
            Some(Event::Failed(fault)) => self.harness.on_driver_failure(self.now, fault),
            Some(Event::Readings(readings)) => {
                self.harness.on_driver_readings(self.now, readings);
            }
        }
    }

    /// Returns the motor positions, full steps since the board's last start, + pays out. Home does
    /// not change them.
    pub fn motors(&self) -> PerMotor<f64> {
        self.harness.motors()
    }

    /// Begins to sample the motor positions every `interval` of the board's time.
    pub fn sample_motors(&mut self, interval: Micros) {
        self.sampler = Some(Sampler::new(Micros(self.now.0 + interval.0), interval));
    }

    /// Takes the samples of the motor positions since the last call, and the number of those that
    /// were dropped because the call came late.
    pub fn take_samples(&mut self) -> (Vec<MotorSample>, u64) {
        self.sampler.as_mut().map(Sampler::take).unwrap_or_default()
    }

    /// Returns the motor rates, full steps/s, + pays out.
    pub fn rates(&self) -> PerMotor<f64> {
        self.harness.rates()
    }

    /// Returns the board's state.
    pub fn state(&self) -> State {
        self.harness.board.state()
    }

    /// Returns the ball's centre, metres in the rig frame; `None` without a rig.
    pub fn ball(&self) -> Option<Point3<f64>> {
        self.plant.as_ref().map(|p| p.ball())
    }

    /// Returns which cables are slack, order A, B, C; all `false` without a rig.
    pub fn slack(&self) -> PerMotor<bool> {
        self.plant.as_ref().map_or([false; MOTORS], |p| p.slack())
    }

    /// Returns the tension of each cable over the ball's weight, order A, B, C; `None` without a
    /// rig, or for a rig without forces.
    pub fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        self.plant.as_ref()?.tensions_per_weight()
    }

    /// Returns the board's core, for inspection.
    pub fn core(&self) -> &Board {
        &self.harness.board
    }

    /// Returns what the board asked of its chip in the last tick; `None` where nothing changed.
    pub fn requests(&self) -> Option<Tick> {
        self.requests
    }

    /// Returns the rig's motor positions, full steps since the rig's start, + pays out.
    fn rig_motors(&self) -> PerMotor<f64> {
        let motors = self.motors();
        std::array::from_fn(|i| self.origin[i] + motors[i])
    }

    /// Restarts the board if one of the link's reboots is due.
    fn restart_if_due(&mut self) {
        while let Some(cause) = self.link.as_mut().and_then(|link| link.reboot(self.now)) {
            self.restart(cause);
        }
    }

    /// Restarts the board with `cause`. The clock continues and the rig keeps its position. The
    /// board has no configuration, and bytes for the host that were not sent are lost.
    pub fn restart(&mut self, cause: StartCause) {
        self.origin = self.rig_motors();
        self.harness.restart(cause, None);
        (self.drivers, self.generation) = (None, 0);
        self.hold.enabled = false;
        if let Some(link) = &mut self.link {
            link.to_host.restart(self.now);
        }
    }

    /// Stops the board for its emergency input, which is open: each motor is `missing` pulses short
    /// of the last tick's plan, as in [`Board::on_emergency_stop`]. Call this before every tick as
    /// long as the input is open.
    pub fn open_emergency(&mut self, missing: PerMotor<i32>) {
        self.harness.on_emergency_stop(self.now, missing);
        self.collect();
    }

    /// Opens the emergency input for this time on the board's clock, as a person who presses the
    /// button. A rehearsal: the motors are where the last tick's plan says.
    pub fn press_emergency_button(&mut self, open: Range<Micros>) {
        self.emergency = open;
    }

    /// Winds in the cables that have run off while motors had no current, as a person who hangs the
    /// ball again, and holds it until the motors have current.
    pub fn hang_again(&mut self) {
        self.hold.hold_by_hand();
        if let Some(plant) = &mut self.plant {
            plant.hang_again();
        }
    }

    /// Returns whether the board has drivers on a UART, by its configuration.
    pub fn has_driver_uart(&self) -> bool {
        self.drivers.is_some()
    }

    /// Lets a motor's driver on a UART have this trouble; drivers of other kinds have none.
    pub fn trouble_driver(&mut self, trouble: DriverTrouble) {
        self.trouble = Some(trouble);
    }

    /// Stops the board because a Motor HAT does not answer. Call this before every tick as long
    /// as that lasts.
    pub fn fail_driver(&mut self) {
        self.harness.on_driver_failure(self.now, DriverFault::Hat);
        self.collect();
    }

    /// Passes the frames that have arrived by now to the board.
    fn deliver(&mut self) {
        while let Some(frame) = self.link.as_mut().and_then(|link| link.to_board.receive(self.now))
        {
            self.harness.receive(self.now, &frame);
            self.collect();
        }
    }

    /// Sends the board's outbox, and collects the bytes that have arrived at the host.
    fn collect(&mut self) {
        match &mut self.link {
            None => self.waiting.extend_from_slice(self.harness.outbox.bytes()),
            Some(link) => {
                link.to_host.send(self.now, self.harness.outbox.bytes());
                while let Some(frame) = link.to_host.receive(self.now) {
                    self.waiting.extend(frame);
                }
            }
        }
        self.harness.outbox.clear();
        let excess = self.waiting.len().saturating_sub(WAITING_BYTES_MAX);
        self.waiting.drain(..excess);
    }
}
