//! Table `[board]` of a rig file: the board's address, its kind and its pins.

use plumb_config::any_case::any_case;
use plumb_protocol::boards::{self, Board};
use plumb_protocol::dimension::MotorList;
use plumb_protocol::provenance::BoardKind;
use plumb_protocol::wiring::{EnablePins, EnablePolarity, MotorPins, Pin, Pins};
use serde::{Deserialize, Deserializer};

use super::quantity::{self, Conversion};

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
    /// STEP of each motor.
    pub step: Option<MotorList<u8>>,
    /// DIR of each motor.
    pub direction: Option<MotorList<u8>>,
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
#[serde(untagged, expecting = "a pin (0 to 29), or a list with a pin for each motor")]
pub enum EnableSetting {
    /// One pin for all drivers.
    Shared(u8),
    /// A pin for each motor.
    PerMotor(MotorList<u8>),
}

/// Inversions in place of those of the board's kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InvertedSettings {
    /// STEP of each motor.
    pub step: Option<MotorList<bool>>,
    /// DIR of each motor.
    pub direction: Option<MotorList<bool>>,
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

/// Returns a motor's entry of a list.
fn of_motor<T: Copy>(list: Option<MotorList<T>>, motor: usize) -> Option<T> {
    list?.get(motor).copied()
}

impl BoardSettings {
    /// Returns the address.
    pub fn address(&self) -> BoardPort {
        BoardPort { port: self.port.clone(), baud: self.baud }
    }

    /// Returns the pins of the kind for `count` motors, with those of the file in their place.
    /// `usual` is the effect of ENABLE of the drivers.
    pub(super) fn pins(
        &self,
        usual: EnableName,
        count: usize,
        conversion: &mut Conversion,
    ) -> Pins {
        let Self { pins, inverted, .. } = self;
        let table = self.kind.board().pins;
        let step = conversion.per_motor("board.pins.step", pins.step, count);
        let direction = conversion.per_motor("board.pins.direction", pins.direction, count);
        let step_inverted = conversion.per_motor("board.inverted.step", inverted.step, count);
        let direction_inverted =
            conversion.per_motor("board.inverted.direction", inverted.direction, count);
        let of =
            |motor, pin: Pin, numbers: Option<MotorList<u8>>, turned: Option<MotorList<bool>>| {
                Pin {
                    number: of_motor(numbers, motor).unwrap_or(pin.number),
                    inverted: of_motor(turned, motor).unwrap_or(pin.inverted),
                }
            };
        let motors = MotorList::from_fn(count, |motor| {
            let own = of_motor(Some(table.motors), motor).unwrap_or_default();
            MotorPins {
                step: of(motor, own.step, step, step_inverted),
                direction: of(motor, own.direction, direction, direction_inverted),
            }
        });
        let enable = match (pins.enable, table.enable) {
            (Some(EnableSetting::Shared(pin)), _) => EnablePins::Shared(pin),
            (Some(EnableSetting::PerMotor(pins)), _) => {
                let pins = conversion.per_motor("board.pins.enable", Some(pins), count);
                EnablePins::PerMotor(pins.unwrap_or_default())
            }
            (None, EnablePins::PerMotor(pins)) => EnablePins::PerMotor(pins.up_to(count)),
            (None, shared) => shared,
        };
        let emergency = Pin {
            number: pins.emergency.unwrap_or(table.emergency.number),
            inverted: inverted.emergency,
        };
        let led = pins.led.or(table.led.map(|led| led.number));
        let led = led.map(|number| Pin { number, inverted: inverted.led });
        Pins { motors, enable, polarity: self.polarity(usual), emergency, led, pen: None }
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
