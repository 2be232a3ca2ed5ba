//! Limits and drivers of the motors, as in rig files.

use std::f64::consts::SQRT_2;

use plumb_config::any_case::any_case;
use plumb_protocol::config::Motor;
use plumb_protocol::dimension::{MOTORS, MotorList};
use plumb_protocol::units::{
    Acceleration, Milliamperes, Milliohms, Milliseconds, Nanoseconds, Rate, Steps16,
};
use plumb_protocol::wiring::{Chopper, Coils, Drivers, StepDir, Tmc2209};
use serde::{Deserialize, Deserializer};

use super::board::{BoardSettings, EnableName};
use super::quantity::{
    self, Conversion, Current, Duty, EnableTime, HighTime, HoldTime, LARGEST_CURRENT_A, LowTime,
    MotorAcceleration, MotorRate, SenseResistor, SetupTime, TravelLimit,
};

/// Limits of the motors, and their drivers.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motors {
    /// Highest rate, full steps/s.
    pub max_rate: MotorRate,
    /// Highest acceleration, full steps/s².
    pub max_acceleration: MotorAcceleration,
    /// Microsteps in a full step: 1, 2, 4, 8 or 16.
    pub microsteps: u8,
    /// Number of the motors: 3, or 2 for a ball in a plane.
    #[serde(default = "default_count", deserialize_with = "quantity::motor_count")]
    pub count: u8,
    /// Lowest and highest position, full steps from where the board started.
    pub travel: [TravelLimit; 2],
    /// Whether each motor turns the wrong way round; by default none.
    pub reversed: Option<MotorList<bool>>,
    /// The drivers of the motors.
    #[serde(default, deserialize_with = "driver")]
    pub driver: Driver,
    /// Times of the driver's inputs in place of its own.
    #[serde(default)]
    pub timing: TimingSettings,
}

fn default_count() -> u8 {
    MOTORS as u8
}

/// Times of a driver's inputs in place of its own, seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimingSettings {
    /// Least time STEP is high.
    pub high: Option<HighTime>,
    /// Least time STEP is low.
    pub low: Option<LowTime>,
    /// Least time from a change of DIR to STEP going high.
    pub setup: Option<SetupTime>,
    /// Least time from STEP going high to a change of DIR.
    pub hold: Option<HoldTime>,
    /// Least time from ENABLE to STEP going high.
    pub enable: Option<EnableTime>,
}

impl TimingSettings {
    /// Puts the times of the file in the place of those of a driver.
    fn apply(&self, times: StepDir, conversion: &mut Conversion) -> StepDir {
        let mut fit = |key, seconds: Option<f64>, own: Nanoseconds| match seconds {
            Some(seconds) => conversion.fit(key, seconds, Nanoseconds::from_si),
            None => own,
        };
        let mut times = StepDir {
            high: fit("motors.timing.high", self.high.map(HighTime::get), times.high),
            low: fit("motors.timing.low", self.low.map(LowTime::get), times.low),
            setup: fit("motors.timing.setup", self.setup.map(SetupTime::get), times.setup),
            hold: fit("motors.timing.hold", self.hold.map(HoldTime::get), times.hold),
            enable: times.enable,
        };
        if let Some(seconds) = self.enable {
            // A time between two milliseconds is rounded up.
            let whole = |seconds: f64| Milliseconds::from_si((seconds * 1e3 - 1e-6).ceil() * 1e-3);
            times.enable = conversion.fit("motors.timing.enable", seconds.get(), whole);
        }
        times
    }
}

impl Motors {
    /// Returns the drivers in the board's units.
    pub(super) fn convert_driver(
        &self,
        board: &BoardSettings,
        conversion: &mut Conversion,
    ) -> Drivers {
        match self.driver.convert(board, self.count(), conversion) {
            Drivers::StepDir(times) => Drivers::StepDir(self.timing.apply(times, conversion)),
            Drivers::Tmc2209(driver) => Drivers::Tmc2209(Tmc2209 {
                times: self.timing.apply(driver.times, conversion),
                ..driver
            }),
            drivers => drivers,
        }
    }

    /// Returns the number of the motors.
    pub fn count(&self) -> usize {
        self.count.into()
    }

    /// Returns whether each motor turns the wrong way round.
    pub fn reversed(&self) -> MotorList<bool> {
        self.reversed.unwrap_or(MotorList::from_fn(self.count(), |_| false))
    }

    /// Returns the motors in the board's units.
    pub(super) fn convert(&self, conversion: &mut Conversion) -> MotorList<Motor> {
        let (rate, acceleration) = (self.max_rate.get(), self.max_acceleration.get());
        let [min, max] = self.travel.map(TravelLimit::get);
        let motor = Motor {
            max_rate: conversion.fit("motors.max_rate", rate, Rate::from_si),
            max_acceleration: conversion.fit(
                "motors.max_acceleration",
                acceleration,
                Acceleration::from_si,
            ),
            travel_min: conversion.fit("motors.travel", min, Steps16::from_si),
            travel_max: conversion.fit("motors.travel", max, Steps16::from_si),
            reversed: false,
        };
        let count = self.count();
        let reversed = conversion.per_motor("motors.reversed", self.reversed, count);
        let reversed = |i: usize| reversed.as_ref().is_some_and(|list| list[i]);
        MotorList::from_fn(count, |i| Motor { reversed: reversed(i), ..motor })
    }
}

/// Driver of the motors: `driver = "a4988"`, or `driver = { coils = { duty = 0.8 } }`.
/// docs/use/board.md says how each is wired.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub enum Driver {
    /// Allegro A4988 and what is as slow: 1 µs pulses.
    #[default]
    A4988,
    /// Texas Instruments DRV8825: 1.9 µs pulses.
    Drv8825,
    /// Trinamic TMC2209 and its like without their UART: 0.2 µs pulses.
    Tmc2209,
    /// Trinamic TMC2209 on one UART, which sets and watches them.
    Tmc2209Uart(UartSettings),
    /// Toshiba TB6600HG behind opto-couplers: 2.2 µs pulses.
    Tb6600,
    /// Leadshine DM542 and its like, with opto-couplers: 2.5 µs pulses.
    Dm542,
    /// Any other driver with STEP and DIR inputs, by its data sheet.
    StepDir {
        /// Least time STEP is high, seconds.
        high: HighTime,
        /// Least time STEP is low, seconds.
        low: LowTime,
        /// Least time from a change of DIR to STEP going high, seconds.
        setup: SetupTime,
    },
    /// Two H-bridges for each motor (TB6612 and the like).
    Coils {
        /// The share of the supply's voltage that a coil gets at most, up to 1.
        duty: Duty,
    },
    /// Two Adafruit Motor HATs.
    MotorHats {
        /// The share of the supply's voltage that a coil gets at most, up to 1.
        duty: Duty,
    },
}

/// Names of the drivers without settings: those that are no table of the file.
const NAMES: [&str; 5] = ["a4988", "drv8825", "tmc2209", "tb6600", "dm542"];

/// Reads a driver. Its name may be written in any case, as on the driver itself.
fn driver<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Driver, D::Error> {
    any_case(deserializer, &NAMES)
}

/// Settings of TMC2209 on a UART.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UartSettings {
    /// Current of a motor that turns, amperes, root mean square.
    pub run_current: Current,
    /// Current of a motor that stands; without it that of a motor that turns.
    pub hold_current: Option<Current>,
    /// How the current is controlled.
    #[serde(default)]
    pub mode: ModeName,
    /// Sense resistor of a coil, ohms.
    #[serde(default = "default_sense")]
    pub sense_resistor: SenseResistor,
    /// Address of each motor's driver; without them those of the board's kind.
    pub addresses: Option<MotorList<u8>>,
}

/// Sense resistor of an SKR Pico and of most modules, ohms.
pub(super) const SENSE: SenseResistor = SenseResistor::constant(0.11);

fn default_sense() -> SenseResistor {
    SENSE
}

/// Peak voltage at the sense resistor of a TMC2209 at the highest setting of the current, volts:
/// with `vsense` 0 and 1 (data sheet, section 9).
const FULL_SCALE_V: [f64; 2] = [0.325, 0.18];
/// Resistance of the chip's own wires beside the sense resistor, ohms (section 9).
const WIRES: f64 = 0.02;
/// Number of the settings of the current (section 9).
const CURRENT_SETTINGS: f64 = 32.0;

/// How a TMC2209 controls the current, as a rig file names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ModeName {
    /// By the voltage: silent.
    #[default]
    StealthChop,
    /// By the current, cycle by cycle.
    SpreadCycle,
}

/// Returns the lowest current of a scale with this highest one, amperes, in whole milliamperes.
fn least_setting(full_scale: f64) -> f64 {
    (full_scale / CURRENT_SETTINGS * 1e3).ceil() / 1e3
}

impl UartSettings {
    /// Returns the settings of a file that names only the current.
    pub fn new(run_current: Current) -> Self {
        let (hold_current, mode, addresses) = (None, ModeName::default(), None);
        Self { run_current, hold_current, mode, sense_resistor: SENSE, addresses }
    }

    /// Returns the highest current with this peak voltage at the sense resistor, amperes, root mean
    /// square (data sheet, section 9).
    fn full_scale(&self, voltage: f64) -> f64 {
        voltage / (self.sense_resistor.get() + WIRES) / SQRT_2
    }

    /// Returns the least and the highest current of a motor that turns, amperes, in whole
    /// milliamperes: the driver can set both.
    pub(super) fn run_range(&self) -> [f64; 2] {
        let [coarse, fine] = FULL_SCALE_V.map(|voltage| self.full_scale(voltage));
        let most = (coarse * 1e3).floor() / 1e3;
        [least_setting(fine), most.min(LARGEST_CURRENT_A)]
    }

    /// Returns the least and the highest current of a motor that stands, amperes. The driver has
    /// one scale for both currents: the finer one where the running current allows it. A standing
    /// motor may always have the running current.
    pub(super) fn hold_range(&self) -> [f64; 2] {
        let [coarse, fine] = FULL_SCALE_V.map(|voltage| self.full_scale(voltage));
        let run = self.run_current.get();
        [least_setting(if run <= fine { fine } else { coarse }).min(run), run]
    }

    /// Returns the settings in the board's units, with the pins and addresses of the board.
    fn convert(&self, board: &BoardSettings, count: usize, conversion: &mut Conversion) -> Tmc2209 {
        let usual = Tmc2209::of(board.kind.board());
        let key = "motors.driver.tmc2209-uart.addresses";
        let addresses = conversion.per_motor(key, self.addresses, count);
        let run = self.run_current.get();
        let hold = self.hold_current.map_or(run, Current::get);
        if hold > run {
            let key = "motors.driver.tmc2209-uart.hold_current";
            conversion.report(key, hold, "is above run_current");
        }
        let mut amperes = |key, amperes| conversion.fit(key, amperes, Milliamperes::from_si);
        let run = amperes("motors.driver.tmc2209-uart.run_current", run);
        let hold = amperes("motors.driver.tmc2209-uart.hold_current", hold);
        let sense = "motors.driver.tmc2209-uart.sense_resistor";
        Tmc2209 {
            run,
            hold,
            sense: conversion.fit(sense, self.sense_resistor.get(), Milliohms::from_si),
            chopper: match self.mode {
                ModeName::StealthChop => Chopper::StealthChop,
                ModeName::SpreadCycle => Chopper::SpreadCycle,
            },
            addresses: addresses.unwrap_or(usual.addresses.up_to(count)),
            uart: board.pins.uart.unwrap_or(usual.uart),
            ..usual
        }
    }
}

impl Driver {
    /// Returns the usual effect of the drivers' ENABLE.
    pub(super) fn enable(&self) -> EnableName {
        match self {
            Self::Tb6600 | Self::Dm542 => EnableName::OptoOff,
            Self::Coils { .. } | Self::MotorHats { .. } => EnableName::ActiveHigh,
            Self::A4988
            | Self::Drv8825
            | Self::Tmc2209
            | Self::Tmc2209Uart(_)
            | Self::StepDir { .. } => EnableName::ActiveLow,
        }
    }

    /// Returns the drivers in the board's units.
    pub(super) fn convert(
        &self,
        board: &BoardSettings,
        count: usize,
        conversion: &mut Conversion,
    ) -> Drivers {
        match self {
            Self::Tmc2209Uart(settings) => {
                Drivers::Tmc2209(settings.convert(board, count, conversion))
            }
            Self::A4988 => Drivers::StepDir(StepDir::A4988),
            Self::Drv8825 => Drivers::StepDir(StepDir::DRV8825),
            Self::Tmc2209 => Drivers::StepDir(StepDir::TMC2209),
            Self::Tb6600 => Drivers::StepDir(StepDir::TB6600),
            Self::Dm542 => Drivers::StepDir(StepDir::DM542),
            Self::StepDir { high, low, setup } => {
                let mut fit = |key, seconds| conversion.fit(key, seconds, Nanoseconds::from_si);
                let high = fit("motors.driver.step-dir.high", high.get());
                Drivers::StepDir(StepDir {
                    high,
                    low: fit("motors.driver.step-dir.low", low.get()),
                    setup: fit("motors.driver.step-dir.setup", setup.get()),
                    hold: high,
                    enable: Milliseconds(0),
                })
            }
            Self::Coils { duty } => {
                Drivers::Coils(coils(conversion, "motors.driver.coils.duty", *duty))
            }
            Self::MotorHats { duty } => {
                Drivers::MotorHats(coils(conversion, "motors.driver.motor-hats.duty", *duty))
            }
        }
    }
}

fn coils(conversion: &mut Conversion, key: &'static str, duty: Duty) -> Coils {
    let percent = |duty: f64| (0.005..=1.0).contains(&duty).then(|| (duty * 100.0).round() as u8);
    Coils { duty_percent: conversion.fit(key, duty.get(), percent) }
}
