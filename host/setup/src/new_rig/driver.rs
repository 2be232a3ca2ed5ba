//! Motor drivers of a new rig file, and the straps that set their microsteps.

use std::fmt;

use plumb_runtime::rig::TMC2209_STRAPS;
use thiserror::Error;

/// Kind of the motor drivers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum DriverKind {
    /// Allegro A4988.
    A4988,
    /// Texas Instruments DRV8825.
    Drv8825,
    /// Trinamic TMC2209, set by its straps.
    Tmc2209,
    /// Trinamic TMC2209 on a UART.
    Tmc2209Uart,
    /// Toshiba TB6600HG, behind opto-couplers.
    Tb6600,
    /// Leadshine DM542 and its like.
    Dm542,
    /// Two H-bridges for each motor.
    Coils,
    /// Two Adafruit Motor HATs.
    MotorHats,
}

/// Microsteps that a driver cannot be strapped to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "the board cannot drive {driver} at {microsteps} microsteps: choose one of {}",
    list(driver.microsteps())
)]
pub struct MicrostepsError {
    /// The driver.
    pub driver: DriverKind,
    /// The microsteps in a full step.
    pub microsteps: u8,
}

fn list(values: &[u8]) -> String {
    values.iter().map(u8::to_string).collect::<Vec<_>>().join(", ")
}

impl DriverKind {
    /// All kinds.
    pub const ALL: [Self; 8] = [
        Self::A4988,
        Self::Drv8825,
        Self::Tmc2209,
        Self::Tmc2209Uart,
        Self::Tb6600,
        Self::Dm542,
        Self::Coils,
        Self::MotorHats,
    ];

    /// Returns the microsteps that the driver and the board support.
    pub fn microsteps(self) -> &'static [u8] {
        match self {
            Self::Tmc2209 => &TMC2209_STRAPS,
            Self::Dm542 => &[2, 4, 8, 16],
            _ => &[1, 2, 4, 8, 16],
        }
    }

    /// Returns the name as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::A4988 => "a4988",
            Self::Drv8825 => "drv8825",
            Self::Tmc2209 => "tmc2209",
            Self::Tmc2209Uart => "tmc2209-uart",
            Self::Tb6600 => "tb6600",
            Self::Dm542 => "dm542",
            Self::Coils => "coils",
            Self::MotorHats => "motor-hats",
        }
    }

    /// Returns the value of `motors.driver`.
    pub(super) fn toml(self) -> String {
        match self {
            Self::Tmc2209Uart => format!("{{ {} = {{ run_current = 0.8 }} }}", self.name()),
            Self::Coils | Self::MotorHats => format!("{{ {} = {{ duty = 0.8 }} }}", self.name()),
            _ => format!("{:?}", self.name()),
        }
    }

    /// Returns the straps for `microsteps`; `None` for drivers without straps.
    ///
    /// # Errors
    /// Where the driver, or the board, cannot have so many.
    pub fn straps(self, microsteps: u8) -> Result<Option<Straps>, MicrostepsError> {
        if !self.microsteps().contains(&microsteps) {
            return Err(MicrostepsError { driver: self, microsteps });
        }
        Ok(match self {
            Self::A4988 => Some(Straps::new(&["MS1", "MS2", "MS3"], a4988(microsteps))),
            Self::Drv8825 => Some(Straps::new(&["M0", "M1", "M2"], drv8825(microsteps))),
            Self::Tmc2209 => Some(Straps::new(&["MS1", "MS2"], tmc2209(microsteps))),
            // The board sets the microsteps of TMC2209 on a UART. The switches of a TB6600 and a
            // DM542 are printed on their boxes, and differ.
            Self::Tmc2209Uart | Self::Tb6600 | Self::Dm542 | Self::Coils | Self::MotorHats => None,
        })
    }
}

impl fmt::Display for DriverKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::A4988 => "an A4988",
            Self::Drv8825 => "a DRV8825",
            Self::Tmc2209 => "a TMC2209 without UART",
            Self::Tmc2209Uart => "a TMC2209 on a UART",
            Self::Tb6600 => "a TB6600",
            Self::Dm542 => "a DM542",
            Self::Coils => "a pair of H-bridges",
            Self::MotorHats => "a Motor HAT",
        })
    }
}

/// Levels of the inputs that set a driver's microsteps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Straps(Vec<(&'static str, bool)>);

impl Straps {
    fn new(pins: &[&'static str], high: &[bool]) -> Self {
        Self(pins.iter().copied().zip(high.iter().copied()).collect())
    }
}

impl fmt::Display for Straps {
    /// Writes "MS1 high, MS2 low".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (pin, high)) in self.0.iter().enumerate() {
            let comma = if index > 0 { ", " } else { "" };
            let level = if *high { "high" } else { "low" };
            write!(f, "{comma}{pin} {level}")?;
        }
        Ok(())
    }
}

/// Returns the levels of MS1, MS2, MS3 (A4988, data sheet rev. 5, table 1).
fn a4988(microsteps: u8) -> &'static [bool] {
    match microsteps {
        1 => &[false, false, false],
        2 => &[true, false, false],
        4 => &[false, true, false],
        8 => &[true, true, false],
        _ => &[true, true, true],
    }
}

/// Returns the levels of MODE0, MODE1, MODE2 (DRV8825, SLVSA73F, table 1).
fn drv8825(microsteps: u8) -> &'static [bool] {
    match microsteps {
        1 => &[false, false, false],
        2 => &[true, false, false],
        4 => &[false, true, false],
        8 => &[true, true, false],
        _ => &[false, false, true],
    }
}

/// Returns the levels of MS1, MS2 (TMC2209, data sheet rev. 1.09, stand-alone mode). The other two
/// settings are 32 and 64 microsteps, which the board does not support.
fn tmc2209(microsteps: u8) -> &'static [bool] {
    match microsteps {
        8 => &[false, false],
        _ => &[true, true],
    }
}
