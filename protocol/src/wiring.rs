//! Wiring of a board: which pin is connected to what, and the motor drivers.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::boards::{self, Board};
use crate::dimension::{LEAST_MOTORS, MOTORS, MotorList};
use crate::provenance::BoardKind;
use crate::units::{Milliamperes, Milliohms, Milliseconds, Nanoseconds};

pub use crate::pins::{EnablePins, EnablePolarity, Line, MotorPins, Pen, Pin, PinError, Pins};

/// Wiring of a board: [`Command::Wire`](crate::Command::Wire).
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, Eq)]
pub struct Wiring {
    /// The board that the pins are those of.
    pub board: BoardKind,
    /// The pins.
    pub pins: Pins,
    /// The motor drivers.
    pub drivers: Drivers,
}

/// Motor drivers. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drivers {
    /// One driver per motor with inputs STEP, DIR and ENABLE.
    StepDir(StepDir),
    /// Two H-bridges per motor on four pins of the board (for example TB6612). 1 microstep means
    /// full steps, 2 half steps; more use pulse-width modulation.
    Coils(Coils),
    /// Two Adafruit Motor HATs (PCA9685 at 0x60: motors A and B, at 0x61: motor C).
    MotorHats(Coils),
    /// One TMC2209 per motor with inputs STEP, DIR and ENABLE, all on one UART, over which the
    /// board sets and watches them.
    Tmc2209(Tmc2209),
}

impl Drivers {
    /// Returns the timing of inputs STEP and DIR; `None` for drivers without them.
    pub const fn step_dir(&self) -> Option<&StepDir> {
        match self {
            Self::StepDir(times) => Some(times),
            Self::Tmc2209(driver) => Some(&driver.times),
            Self::Coils(_) | Self::MotorHats(_) => None,
        }
    }

    /// Returns the settings of TMC2209 on a UART.
    pub const fn tmc2209(&self) -> Option<&Tmc2209> {
        match self {
            Self::Tmc2209(driver) => Some(driver),
            _ => None,
        }
    }
}

/// Settings of TMC2209 drivers on one UART. The data sheet is rev. 1.09.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tmc2209 {
    /// Timing of STEP, DIR and ENABLE.
    pub times: StepDir,
    /// The board's pins of the UART: TX (through 1 kΩ) and RX, both at PDN_UART of all drivers.
    pub uart: [u8; 2],
    /// Address of each motor's driver, by MS1 and MS2: 0 to 3, each once.
    pub addresses: MotorList<u8>,
    /// Current of a motor that turns, root mean square: what the sense resistor allows.
    pub run: Milliamperes,
    /// Current of a motor that stands, likewise; at most [`run`](Self::run).
    pub hold: Milliamperes,
    /// Sense resistor of a coil: 50 to 1000 mΩ.
    pub sense: Milliohms,
    /// How a coil's current is controlled.
    pub chopper: Chopper,
}

/// How a TMC2209 controls the current of a coil. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chopper {
    /// By the voltage: silent. StallGuard reads the load in this mode only.
    StealthChop,
    /// By the current, cycle by cycle: more torque at speed, and audible.
    SpreadCycle,
}

impl Tmc2209 {
    /// Returns the settings with the pins and addresses of a board's table: 0.8 A in motion and at
    /// rest with 0.11 Ω, StealthChop.
    pub const fn of(board: &Board) -> Self {
        let boards::DriverUart { pins, addresses, .. } = board.driver_uart;
        Self {
            times: Self::TIMES,
            uart: pins,
            addresses: MotorList::new(addresses),
            run: Milliamperes(800),
            hold: Milliamperes(800),
            sense: Milliohms(110),
            chopper: Chopper::StealthChop,
        }
    }

    /// Returns whether the addresses are 0 to 3, each once.
    fn has_right_addresses(&self) -> bool {
        let mut seen = 0_u8;
        self.addresses.iter().all(|&address| {
            let bit = 1_u8.checked_shl(address.into()).unwrap_or(0) & 0b1111;
            let is_new = bit != 0 && seen & bit == 0;
            seen |= bit;
            is_new
        })
    }

    /// Times of STEP and DIR as [`StepDir::TMC2209`] has them. The first part of StealthChop's
    /// tuning wants the motor to stand for 130 ms with its current (section 6.1).
    pub const TIMES: StepDir = StepDir { enable: Milliseconds(130), ..StepDir::TMC2209 };
}

/// Timing of a driver's inputs, from its data sheet.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepDir {
    /// Minimum time of STEP high.
    pub high: Nanoseconds,
    /// Minimum time of STEP low.
    pub low: Nanoseconds,
    /// Minimum setup time from a change of DIR to the rising edge of STEP.
    pub setup: Nanoseconds,
    /// Minimum hold time from the rising edge of STEP to a change of DIR. DIR is held for as long
    /// as STEP is high in any case.
    pub hold: Nanoseconds,
    /// Minimum time from ENABLE to the first rising edge of STEP: up to 200 ms.
    pub enable: Milliseconds,
}

impl StepDir {
    /// Allegro A4988 (data sheet rev. 5, figure 1).
    pub const A4988: Self = Self::new(1000, 1000, 200, 200);
    /// Texas Instruments DRV8825 (SLVSA73F, section 6.6).
    pub const DRV8825: Self = Self::new(1900, 1900, 650, 650);
    /// Trinamic TMC2209: about twice the least times of its data sheet (rev. 1.09, section 13.1).
    /// They depend on its clock: for STEP a period and 20 ns, 103 ns at the nominal 12 MHz.
    pub const TMC2209: Self = Self::new(200, 200, 50, 50);
    /// Toshiba TB6600HG (data sheet: CLK pulse width of 2.2 µs). It gives no other times: those of
    /// the [`DM542`](Self::DM542) serve, but for ENABLE.
    pub const TB6600: Self = Self { enable: Milliseconds(1), ..Self::new(2200, 2200, 5000, 5000) };
    /// Leadshine DM542 (user's manual, sequence chart of control signals). It gives no hold time of
    /// DIR: that of its set-up serves.
    pub const DM542: Self = Self { enable: Milliseconds(200), ..Self::new(2500, 2500, 5000, 5000) };

    /// Returns a driver without a delay after ENABLE; all times in nanoseconds.
    pub const fn new(high: u16, low: u16, setup: u16, hold: u16) -> Self {
        Self {
            high: Nanoseconds(high),
            low: Nanoseconds(low),
            setup: Nanoseconds(setup),
            hold: Nanoseconds(hold),
            enable: Milliseconds(0),
        }
    }
}

/// Settings of the coil drivers.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coils {
    /// Highest coil voltage as a percentage of the supply voltage: 1 to 100.
    pub duty_percent: u8,
}

/// Reason why a board refuses a wiring. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum WiringError {
    /// The kind of board has another chip, or none.
    Board,
    /// This kind of board cannot have coils or Motor HATs: it has drivers of its own.
    Drivers,
    /// A line cannot be at its pin.
    Pin(Line, PinError),
    /// An address of a driver is above 3, another driver's too, or there are fewer than motors.
    Addresses,
    /// STEP must be high for longer than the chip's step generator can make a pulse.
    Pulse,
    /// The emergency input is inverted, and the chip's pull-down does not hold an input low
    /// (RP2350-E9): it would not see that a wire is cut.
    InvertedEmergency,
    /// There are fewer than two motors, or more than this board steps; or the ENABLE pins are not
    /// as many.
    Motors,
    /// This board has no pen.
    Pen,
}

impl PartialEq for Wiring {
    /// Compares as a derived implementation does; the firmware has one copy of it.
    #[cold]
    #[inline(never)]
    fn eq(&self, other: &Self) -> bool {
        let Self { board, pins, drivers } = self;
        (board, pins, drivers) == (&other.board, &other.pins, &other.drivers)
    }
}

impl Wiring {
    /// Returns the wiring of a Pico with its default pins, as docs/use/board.md draws them.
    pub const fn pico(drivers: Drivers) -> Self {
        let polarity = match drivers {
            Drivers::StepDir(_) | Drivers::Tmc2209(_) => EnablePolarity::ActiveLow,
            Drivers::Coils(_) | Drivers::MotorHats(_) => EnablePolarity::ActiveHigh,
        };
        Self { board: BoardKind::Pico, pins: Pins { polarity, ..boards::PICO.pins }, drivers }
    }

    /// Returns this wiring with the first `count` motors of it alone.
    #[must_use]
    pub fn of_motors(mut self, count: usize) -> Self {
        self.pins.motors = self.pins.motors.up_to(count);
        if let EnablePins::PerMotor(pins) = &mut self.pins.enable {
            *pins = pins.up_to(count);
        }
        if let Drivers::Tmc2209(driver) = &mut self.drivers {
            driver.addresses = driver.addresses.up_to(count);
        }
        self
    }

    /// Returns a wiring that every RP2040 accepts: a Pico with TMC2209 drivers.
    pub const fn example() -> Self {
        Self::pico(Drivers::StepDir(StepDir::TMC2209))
    }

    /// Returns the lines in use with their pins: without STEP and DIR where coils or Motor HATs
    /// take their place.
    pub fn lines(&self) -> impl Iterator<Item = (Line, u8)> + '_ {
        let has_steps = self.drivers.step_dir().is_some();
        let motors = self.pins.motors.iter().filter(move |_| has_steps).zip(0..);
        let steps = motors.flat_map(|(pins, motor)| {
            let (step, direction) = (pins.step.number, pins.direction.number);
            [(Line::Step(motor), step), (Line::Direction(motor), direction)]
        });
        let enable = self.pins.enable.numbers().iter().zip(0..);
        let enable = enable.map(|(pin, index)| (Line::Enable(index), *pin));
        let led = self.pins.led.map(|pin| (Line::Led, pin.number));
        let emergency = [(Line::Emergency, self.pins.emergency.number)];
        let uart = self.drivers.tmc2209().into_iter();
        let uart =
            uart.flat_map(|driver| [Line::UartTx, Line::UartRx].into_iter().zip(driver.uart));
        steps.chain(enable).chain(emergency).chain(led).chain(uart)
    }

    /// Returns the fixed pins of the drivers, a bit each: those of the motors' coils, or of Motor
    /// HATs.
    pub fn driver_pins(&self) -> u32 {
        match self.drivers {
            Drivers::StepDir(_) | Drivers::Tmc2209(_) => 0,
            Drivers::Coils(_) => boards::coils(self.pins.motors.len()),
            Drivers::MotorHats(_) => boards::HATS,
        }
    }

    /// Calls `report` for every reason to refuse this wiring, in the order of the fields.
    ///
    /// `chip` is the chip of the build; `None` accepts the boards of every chip. Where a kind of
    /// board has no pins, nothing else is checked.
    pub fn each_error(&self, chip: Option<boards::Chip>, mut report: impl FnMut(WiringError)) {
        let board = Board::of(self.board);
        let Some(board) = board.filter(|board| chip.is_none_or(|chip| chip == board.chip)) else {
            return report(WiringError::Board);
        };
        if !board.has_free_drivers && self.drivers.step_dir().is_none() {
            report(WiringError::Drivers);
        }
        let motors = self.pins.motors.len();
        let has_enables = match &self.pins.enable {
            EnablePins::Shared(_) => true,
            EnablePins::PerMotor(pins) => pins.len() == motors,
        };
        if !(LEAST_MOTORS..=MOTORS).contains(&motors) || !has_enables {
            report(WiringError::Motors);
        }
        if self.pins.pen.is_some() {
            report(WiringError::Pen);
        }
        let wrong =
            |driver: &Tmc2209| driver.addresses.len() != motors || !driver.has_right_addresses();
        if self.drivers.tmc2209().is_some_and(wrong) {
            report(WiringError::Addresses);
        }
        if self.drivers.step_dir().is_some_and(|times| times.high > board.chip.widest_pulse()) {
            report(WiringError::Pulse);
        }
        if self.pins.emergency.inverted && board.chip.has_latching_inputs() {
            report(WiringError::InvertedEmergency);
        }
        let mut used = self.driver_pins();
        for (line, pin) in self.lines() {
            let bit = 1_u32.checked_shl(pin.into()).unwrap_or(0);
            let error = match board.line_error(line, pin) {
                None if used & bit != 0 => Some(PinError::Twice),
                error => error,
            };
            used |= bit;
            if let Some(error) = error {
                report(WiringError::Pin(line, error));
            }
        }
    }

    /// Checks this wiring for a build of this chip.
    ///
    /// # Errors
    /// The first reason to refuse it.
    #[cold]
    pub fn check(&self, chip: Option<boards::Chip>) -> Result<(), WiringError> {
        let mut first = Ok(());
        self.each_error(chip, |error| {
            if first.is_ok() {
                first = Err(error);
            }
        });
        first
    }
}
