//! Pins of a board, and the lines between them and its surroundings.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::dimension::MotorList;
use crate::units::{Microseconds, Milliseconds};

/// Pins of a board by their GPIO numbers, 0 to 29.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pins {
    /// STEP and DIR of each motor: as many as the configuration has. Unused with coils and Motor
    /// HATs, which have fixed pins.
    pub motors: MotorList<MotorPins>,
    /// ENABLE of the drivers.
    pub enable: EnablePins,
    /// Level of ENABLE that gives the motors current.
    pub polarity: EnablePolarity,
    /// Emergency input: connected to ground in operation, open to stop. An inverted one is
    /// connected to 3.3 V in operation; an RP2350 refuses it
    /// ([`WiringError::InvertedEmergency`](crate::wiring::WiringError::InvertedEmergency)).
    pub emergency: Pin,
    /// Light that blinks while the program runs; `None` for a board without one.
    pub led: Option<Pin>,
    /// Servo that lifts a pen; `None` without one. Boards of this version refuse a pen.
    pub pen: Option<Pen>,
}

/// Servo of a pen: its pin and its two positions, as widths of the pulse that it gets every 20 ms.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pen {
    /// GPIO number.
    pub pin: u8,
    /// Width of the pulse for a lifted pen: that of every stop.
    pub up: Microseconds,
    /// Width of the pulse for a pen on the paper.
    pub down: Microseconds,
    /// Time that the servo takes from one to the other.
    pub travel: Milliseconds,
}

/// A pin, and whether its level is inverted.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pin {
    /// GPIO number.
    pub number: u8,
    /// Whether the pin is low where it would be high.
    pub inverted: bool,
}

impl Pin {
    /// Returns a pin that is not inverted.
    pub const fn new(number: u8) -> Self {
        Self { number, inverted: false }
    }

    /// Returns an inverted pin.
    pub const fn inverted(number: u8) -> Self {
        Self { number, inverted: true }
    }
}

/// Pins of a motor's driver. DIR is high to pay out, unless the motor is reversed or the pin
/// is inverted.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MotorPins {
    /// STEP: a pulse is high.
    pub step: Pin,
    /// DIR.
    pub direction: Pin,
}

/// Pins of ENABLE.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum EnablePins {
    /// One pin for all drivers.
    Shared(u8),
    /// A pin for each motor.
    PerMotor(MotorList<u8>),
}

impl EnablePins {
    /// Returns the pins in the order of the motors, or the one pin.
    pub fn numbers(&self) -> &[u8] {
        match self {
            Self::Shared(pin) => core::slice::from_ref(pin),
            Self::PerMotor(pins) => pins,
        }
    }
}

/// Effect of ENABLE. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum EnablePolarity {
    /// Low gives the motors current, as with an A4988 or a TMC2209.
    ActiveLow,
    /// High gives the motors current, as with the STBY input of a TB6612.
    ActiveHigh,
    /// High sends a current through an opto-coupler, which switches the motors off. Without a
    /// current there, as from a board in reset, the motors are on.
    OptoOffHigh,
    /// The same with a low pin, which sinks that current.
    OptoOffLow,
}

/// A line between the board and its surroundings.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Line {
    /// STEP of a motor (0 = A, 1 = B, 2 = C).
    Step(u8),
    /// DIR of a motor.
    Direction(u8),
    /// ENABLE: the shared one, or that of a motor.
    Enable(u8),
    /// The emergency input.
    Emergency,
    /// The light.
    Led,
    /// TX of the drivers' UART.
    UartTx,
    /// RX of the drivers' UART.
    UartRx,
}

/// Reason why a line cannot be at a pin.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PinError {
    /// The board has no such pin.
    Missing,
    /// The board uses the pin itself.
    Taken,
    /// Another line is at this pin, or the coils or the Motor HATs are.
    Twice,
    /// The drivers' UART is not at this pin.
    NoUart,
}
