//! Table `[board]` of a rig file: the board's address, its kind and its pins.

use std::array;

use plumb_config::any_case::any_case;
use plumb_protocol::boards::{self, Board};
use plumb_protocol::dimension::PerMotor;
use plumb_protocol::provenance::BoardKind;
use plumb_protocol::wiring::{EnablePins, EnablePolarity, MotorPins, Pin, Pins};
use serde::{Deserialize, Deserializer};

use super::quantity;

/// The board: its address, its kind and its pins.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardSettings {
    /// Path of its serial port.
    pub port: String,
    /// Rate of the port, bit/s; without effect on USB-CDC.
    #[serde(default = "default_baud", deserialize_with = "quantity::baud")]
    pub baud: u32,
    /// Its kind, from which its pins follow.
    #[serde(default, deserialize_with = "kind")]
    pub kind: BoardName,
    /// Effect of ENABLE; without it that of the drivers.
    pub enable: Option<EnableName>,
    /// Pins in place of those of the kind.
    #[serde(default)]
    pub pins: PinSettings,
    /// Inversions in place of those of the kind.
    #[serde(default)]
    pub inverted: InvertedSettings,
}

/// Address of a board.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BoardPort {
    /// Path of its serial port.
    pub port: String,
    /// Rate of the port, bit/s; without effect on USB-CDC.
    pub baud: u32,
}

fn default_baud() -> u32 {
    115_200
}

/// Kind of a board, as a rig file names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum BoardName {
    /// Raspberry Pi Pico.
    #[default]
    #[serde(rename = "pico")]
    Pico,
    /// Raspberry Pi Pico 2.
    #[serde(rename = "pico2")]
    Pico2,
    /// BIGTREETECH SKR Pico.
    #[serde(rename = "skr-pico")]
    SkrPico,
}

/// Reads the kind of a board. Its name may be written in any case.
fn kind<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BoardName, D::Error> {
    any_case(deserializer, &[boards::PICO.name, boards::PICO_2.name, boards::SKR_PICO.name])
}

impl BoardName {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Pico, Self::Pico2, Self::SkrPico];

    /// Returns the kind as the protocol has it.
    pub fn kind(self) -> BoardKind {
        self.board().kind
    }

    /// Returns the board's entry in the table of boards.
    pub fn board(self) -> &'static Board {
        match self {
            Self::Pico => &boards::PICO,
            Self::Pico2 => &boards::PICO_2,
            Self::SkrPico => &boards::SKR_PICO,
        }
    }
}

/// Effect of ENABLE, as a rig file names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EnableName {
    /// Low gives the motors current.
    ActiveLow,
    /// High gives the motors current.
    ActiveHigh,
    /// A current through an opto-coupler switches the motors off; high gives that current.
    OptoOff,
}

/// Pins in place of those of the board's kind, by their GPIO numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PinSettings {
    /// STEP of motors A, B, C.
    pub step: Option<PerMotor<u8>>,
    /// DIR of motors A, B, C.
    pub direction: Option<PerMotor<u8>>,
    /// ENABLE: one pin for all drivers, or one for each.
    pub enable: Option<EnableSetting>,
    /// Emergency input.
    pub emergency: Option<u8>,
    /// Light.
    pub led: Option<u8>,
    /// TX and RX of the drivers' UART.
    pub uart: Option<[u8; 2]>,
}

/// Pins of ENABLE.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(untagged, expecting = "a pin (0 to 29), or a list of three pins")]
pub enum EnableSetting {
    /// One pin for all drivers.
    Shared(u8),
    /// A pin for each of motors A, B, C.
    PerMotor(PerMotor<u8>),
}

/// Inversions in place of those of the board's kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InvertedSettings {
    /// STEP of motors A, B, C.
    pub step: Option<PerMotor<bool>>,
    /// DIR of motors A, B, C.
    pub direction: Option<PerMotor<bool>>,
    /// ENABLE.
    #[serde(default)]
    pub enable: bool,
    /// Emergency input.
    #[serde(default)]
    pub emergency: bool,
    /// Light.
    #[serde(default)]
    pub led: bool,
}

impl BoardSettings {
    /// Returns the address.
    pub fn address(&self) -> BoardPort {
        BoardPort { port: self.port.clone(), baud: self.baud }
    }

    /// Returns the pins of the kind with those of the file in their place. `usual` is the effect of
    /// ENABLE of the drivers.
    pub(super) fn pins(&self, usual: EnableName) -> Pins {
        let Self { pins, inverted, .. } = self;
        let table = self.kind.board().pins;
        let motors: PerMotor<MotorPins> = array::from_fn(|motor| {
            let of =
                |pin: Pin, number: Option<PerMotor<u8>>, inverted: Option<PerMotor<bool>>| Pin {
                    number: number.map_or(pin.number, |numbers| numbers[motor]),
                    inverted: inverted.map_or(pin.inverted, |inverted| inverted[motor]),
                };
            let MotorPins { step, direction } = table.motors[motor];
            MotorPins {
                step: of(step, pins.step, inverted.step),
                direction: of(direction, pins.direction, inverted.direction),
            }
        });
        let enable = pins.enable.map_or(table.enable, |enable| match enable {
            EnableSetting::Shared(pin) => EnablePins::Shared(pin),
            EnableSetting::PerMotor(pins) => EnablePins::PerMotor(pins),
        });
        let emergency = Pin {
            number: pins.emergency.unwrap_or(table.emergency.number),
            inverted: inverted.emergency,
        };
        let led = pins.led.or(table.led.map(|led| led.number));
        let led = led.map(|number| Pin { number, inverted: inverted.led });
        Pins { motors, enable, polarity: self.polarity(usual), emergency, led }
    }

    /// Returns the effect of ENABLE.
    fn polarity(&self, usual: EnableName) -> EnablePolarity {
        use EnablePolarity::{ActiveHigh, ActiveLow, OptoOffHigh, OptoOffLow};
        let inverted = |plain, inverted| if self.inverted.enable { inverted } else { plain };
        match self.enable.unwrap_or(usual) {
            EnableName::ActiveLow => inverted(ActiveLow, ActiveHigh),
            EnableName::ActiveHigh => inverted(ActiveHigh, ActiveLow),
            EnableName::OptoOff => inverted(OptoOffHigh, OptoOffLow),
        }
    }
}
