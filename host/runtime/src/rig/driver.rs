//! Drivers of the motors, as in rig files.

use plumb_protocol::config::{Coils, Drivers, StepDir};
use plumb_protocol::units::Nanoseconds;
use serde::Deserialize;

use super::conversion::Conversion;
use super::quantity::{Duty, HighTime, LowTime, SetupTime};

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
    /// Trinamic TMC2209 and its like: 0.2 µs pulses.
    Tmc2209,
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

impl Driver {
    /// Returns the drivers in the board's units.
    pub(super) fn convert(&self, conversion: &mut Conversion) -> Drivers {
        match self {
            Self::A4988 => Drivers::StepDir(StepDir::A4988),
            Self::Drv8825 => Drivers::StepDir(StepDir::DRV8825),
            Self::Tmc2209 => Drivers::StepDir(StepDir::TMC2209),
            Self::StepDir { high, low, setup } => {
                let mut fit = |key, seconds| conversion.fit(key, seconds, Nanoseconds::from_si);
                Drivers::StepDir(StepDir {
                    high: fit("motors.driver.step-dir.high", high.get()),
                    low: fit("motors.driver.step-dir.low", low.get()),
                    setup: fit("motors.driver.step-dir.setup", setup.get()),
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
