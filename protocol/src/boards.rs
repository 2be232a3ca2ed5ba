//! The table of boards: their pins, and which of them a wiring cannot have. Host, board core and
//! firmware read the same table.

use crate::dimension::{MOTORS, MotorList};
use crate::pins::{EnablePins, EnablePolarity, Line, MotorPins, Pin, PinError, Pins};
use crate::provenance::BoardKind;
use crate::units::Nanoseconds;

/// Number of the chips' pins: GP0 to GP29.
pub const PIN_COUNT: u8 = 30;

/// Pins of the link to the host, on every board: UART0's TX and RX.
pub const UART: [u8; 2] = [0, 1];

/// Returns the pins of the coils of `motors` motors, a bit each: four for each, from GP2 on.
pub const fn coils(motors: usize) -> u32 {
    ((1 << (4 * motors)) - 1) << 2
}

/// Pins of the Motor HATs' bus, a bit each: GP16 (SDA) and GP17 (SCL).
pub const HATS: u32 = 1 << 16 | 1 << 17;

/// Pins that can be TX and RX of the drivers' UART, which is UART1, a bit each (RP2040 data sheet,
/// section 2.19.2).
pub const DRIVER_UART: [u32; 2] =
    [1 << 4 | 1 << 8 | 1 << 20 | 1 << 24, 1 << 5 | 1 << 9 | 1 << 21 | 1 << 25];

/// Clocks of the widest STEP pulse that the step generator makes: one, and a loop of 32 rounds of
/// 16 clocks (`PulseWidth` in plumb-core).
pub const WIDEST_PULSE_CLOCKS: u32 = 513;

/// Chip of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chip {
    /// RP2040.
    Rp2040,
    /// RP2350A.
    Rp2350,
}

impl Chip {
    /// Returns the frequency of the clock that pulses are placed on, Hz.
    pub const fn clock_hz(self) -> u32 {
        match self {
            Self::Rp2040 => 125_000_000,
            Self::Rp2350 => 150_000_000,
        }
    }

    /// Returns whether an input with the chip's pull-down may stay at about 2 V (RP2350-E9,
    /// stepping A2).
    pub const fn has_latching_inputs(self) -> bool {
        matches!(self, Self::Rp2350)
    }

    /// Returns the clocks of a time, rounded up.
    #[inline]
    pub const fn clocks(self, time: Nanoseconds) -> u32 {
        (time.0 as u32 * (self.clock_hz() / 1_000_000)).div_ceil(1000)
    }

    /// Returns the widest STEP pulse, rounded down: 4104 ns on an RP2040, 3420 ns on an RP2350.
    pub const fn widest_pulse(self) -> Nanoseconds {
        Nanoseconds((WIDEST_PULSE_CLOCKS * 1000 / (self.clock_hz() / 1_000_000)) as u16)
    }
}

/// A pin that the board uses itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TakenPin {
    /// GPIO number.
    pub number: u8,
    /// What the pin is connected to.
    pub to: &'static str,
    /// Level at which the firmware holds it once the board is configured; `None` leaves it an
    /// input.
    pub held: Option<bool>,
}

impl TakenPin {
    const fn new(number: u8, to: &'static str) -> Self {
        Self { number, to, held: None }
    }

    const fn held(number: u8, to: &'static str, level: bool) -> Self {
        Self { number, to, held: Some(level) }
    }
}

/// A kind of board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Board {
    /// The kind.
    pub kind: BoardKind,
    /// Its name in a rig file.
    pub name: &'static str,
    /// Its chip.
    pub chip: Chip,
    /// The pins of a wiring that names no others.
    pub pins: Pins,
    /// Pins that the board uses itself, besides [`UART`].
    pub taken: &'static [TakenPin],
    /// Whether the drivers are not part of the board, so that it may have coils or Motor HATs.
    pub has_free_drivers: bool,
    /// The UART of TMC2209 drivers.
    pub driver_uart: DriverUart,
}

/// UART of TMC2209 drivers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DriverUart {
    /// TX and RX of a wiring that names no others.
    pub pins: [u8; 2],
    /// Addresses of the drivers of motors A, B and C of a wiring that names no others.
    pub addresses: [u8; MOTORS],
    /// Whether the drivers are part of the board, so that no other pins will do.
    pub is_fixed: bool,
}

/// UART of the drivers that a wiring of a Pico names no other for.
const PICO_UART: DriverUart = DriverUart { pins: [8, 9], addresses: [0, 1, 2], is_fixed: false };

/// Pins of a Raspberry Pi Pico that a wiring names no others for.
const PICO_PINS: Pins = Pins {
    motors: MotorList::new([
        MotorPins { step: Pin::new(2), direction: Pin::new(3) },
        MotorPins { step: Pin::new(4), direction: Pin::new(5) },
        MotorPins { step: Pin::new(6), direction: Pin::new(7) },
    ]),
    enable: EnablePins::Shared(14),
    polarity: EnablePolarity::ActiveLow,
    emergency: Pin::new(15),
    led: Some(Pin::new(25)),
    pen: None,
};

/// Pins that a Pico and a Pico 2 use themselves (Pico data sheet, section 2.1; Pico 2 data sheet,
/// section 2.1).
const PICO_TAKEN: &[TakenPin] = &[
    TakenPin::new(23, "the power save of its regulator"),
    TakenPin::new(24, "the sense of VBUS"),
    TakenPin::new(29, "the measurement of VSYS"),
];

/// Raspberry Pi Pico.
pub const PICO: Board = Board {
    kind: BoardKind::Pico,
    name: "pico",
    chip: Chip::Rp2040,
    pins: PICO_PINS,
    taken: PICO_TAKEN,
    has_free_drivers: true,
    driver_uart: PICO_UART,
};

/// Raspberry Pi Pico 2.
pub const PICO_2: Board = Board {
    kind: BoardKind::Pico2,
    name: "pico2",
    chip: Chip::Rp2350,
    pins: PICO_PINS,
    taken: PICO_TAKEN,
    has_free_drivers: true,
    driver_uart: PICO_UART,
};

/// BIGTREETECH SKR Pico V1.0: motors A, B, C on its X, Y, Z. The pins are those of the maker's
/// pin diagram, and of Klipper's `config/generic-bigtreetech-skr-pico-v1.0.cfg`, which inverts DIR
/// of X and Y.
pub const SKR_PICO: Board = Board {
    kind: BoardKind::SkrPico,
    name: "skr-pico",
    chip: Chip::Rp2040,
    pins: Pins {
        motors: MotorList::new([
            MotorPins { step: Pin::new(11), direction: Pin::inverted(10) },
            MotorPins { step: Pin::new(6), direction: Pin::inverted(5) },
            MotorPins { step: Pin::new(19), direction: Pin::new(28) },
        ]),
        enable: EnablePins::PerMotor(MotorList::new([12, 7, 2])),
        polarity: EnablePolarity::ActiveLow,
        emergency: Pin::new(4),
        led: None,
        pen: None,
    },
    taken: &[
        TakenPin::new(8, "the UART of its drivers"),
        TakenPin::new(9, "the UART of its drivers"),
        TakenPin::held(15, "ENABLE of its driver E", true),
        TakenPin::held(17, "a fan", false),
        TakenPin::held(18, "a fan", false),
        TakenPin::held(20, "a fan", false),
        TakenPin::held(21, "the heater of a bed", false),
        TakenPin::held(23, "a heater", false),
        TakenPin::held(24, "its RGB light", false),
        TakenPin::new(26, "a thermistor"),
        TakenPin::new(27, "a thermistor"),
    ],
    has_free_drivers: false,
    driver_uart: DriverUart { pins: [8, 9], addresses: [0, 2, 1], is_fixed: true },
};

/// All boards.
pub const ALL: [&Board; 3] = [&PICO, &PICO_2, &SKR_PICO];

impl Board {
    /// Returns the board of this kind; `None` for one without pins.
    pub fn of(kind: BoardKind) -> Option<&'static Self> {
        ALL.into_iter().find(|board| board.kind == kind)
    }

    /// Returns what the board uses this pin for itself; `None` for a free pin.
    pub fn taken(&self, pin: u8) -> Option<&'static str> {
        if UART.contains(&pin) {
            return Some("the serial line to the computer");
        }
        self.taken.iter().find(|taken| taken.number == pin).map(|taken| taken.to)
    }

    /// Returns why this line cannot be at this pin; `None` if it can.
    pub fn line_error(&self, line: Line, pin: u8) -> Option<PinError> {
        let end = match line {
            Line::UartTx => 0,
            Line::UartRx => 1,
            _ => return self.pin_error(pin),
        };
        let DriverUart { pins, is_fixed, .. } = self.driver_uart;
        match self.pin_error(pin) {
            Some(PinError::Missing) => Some(PinError::Missing),
            _ if is_fixed => (pins[end] != pin).then_some(PinError::NoUart),
            None => (DRIVER_UART[end] >> pin & 1 == 0).then_some(PinError::NoUart),
            error => error,
        }
    }

    /// Returns why no line can be at this pin; `None` for a free pin.
    pub fn pin_error(&self, pin: u8) -> Option<PinError> {
        match self.taken(pin) {
            _ if pin >= PIN_COUNT => Some(PinError::Missing),
            Some(_) => Some(PinError::Taken),
            None => None,
        }
    }
}
