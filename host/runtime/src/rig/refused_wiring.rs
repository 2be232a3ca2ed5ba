//! Wirings that the board refuses, by the keys of the rig file.

use plumb_protocol::MOTORS;
use plumb_protocol::boards::Board;
use plumb_protocol::units::Nanoseconds;
use plumb_protocol::wiring::{Line, PinError, Wiring, WiringError};

use super::motors::{Driver, Motors};
use super::quantity::OutOfRange;

/// Returns the refusal of the wiring of a rig with these `motors` for `error`, with the key that it
/// follows from.
pub(super) fn refusal(motors: &Motors, wiring: &Wiring, error: WiringError) -> OutOfRange {
    let (key, why) = match error {
        WiringError::Board => ("board.kind", "names a board that this one is not".to_owned()),
        WiringError::Drivers => (
            "motors.driver",
            format!("does not fit {}, which has drivers of its own", wiring.board),
        ),
        WiringError::Addresses => (
            "motors.driver.tmc2209-uart.addresses",
            "has an address above 3, or one twice".to_owned(),
        ),
        WiringError::Motors => ("motors.count", format!("is not from 2 to {MOTORS}")),
        // No key of the file gives a pen.
        WiringError::Pen => ("board.pins", error.to_string()),
        WiringError::Pin(line, error) => (key(line), problem(wiring, line, error)),
        WiringError::Pulse => (pulse_key(motors), wide_pulse(wiring)),
        WiringError::InvertedEmergency => ("board.inverted.emergency", latching_input(wiring)),
    };
    OutOfRange { key, value: None, why }
}

/// Returns the key that the width of the STEP pulses follows from.
fn pulse_key(motors: &Motors) -> &'static str {
    match motors.driver {
        Driver::StepDir { .. } if motors.timing.high.is_none() => "motors.driver.step-dir.high",
        _ => "motors.timing.high",
    }
}

/// Returns what is wrong with STEP pulses that are too wide for the chip.
fn wide_pulse(wiring: &Wiring) -> String {
    let board = wiring.board;
    let widest = Board::of(board).map_or(Nanoseconds(0), |board| board.chip.widest_pulse());
    format!(
        "is above {:.2}e-6 s, the widest pulse that {board} makes: choose a driver with a faster \
         input, or another board",
        f64::from(widest.0) / 1000.0
    )
}

/// Returns the key that a line's pin follows from.
pub(super) fn key(line: Line) -> &'static str {
    match line {
        Line::Step(_) => "board.pins.step",
        Line::Direction(_) => "board.pins.direction",
        Line::Enable(_) => "board.pins.enable",
        Line::Emergency => "board.pins.emergency",
        Line::Led => "board.pins.led",
        Line::UartTx | Line::UartRx => "board.pins.uart",
    }
}

/// Returns what is wrong with an inverted emergency input of a chip whose pull-down does not hold
/// an input low. A resistor outside would, but no program sees whether it is there.
fn latching_input(wiring: &Wiring) -> String {
    format!(
        "is unsafe on {}: its pull-down does not hold an input low (erratum RP2350-E9), so that a \
         wire that is cut may read as closed. Leave this key out, and put the contact between the \
         pin and ground: that input has a pull-up",
        wiring.board
    )
}

/// Returns the pin of a line.
fn pin_of(wiring: &Wiring, line: Line) -> u8 {
    wiring.lines().find(|(other, _)| *other == line).map_or(0, |(_, pin)| pin)
}

/// Returns the other line at the pin of `line`.
pub(super) fn other_line(wiring: &Wiring, line: Line) -> Option<Line> {
    let pin = pin_of(wiring, line);
    wiring.lines().find(|(other, at)| *other != line && *at == pin).map(|(other, _)| other)
}

/// Returns what is wrong with the pin of a line.
fn problem(wiring: &Wiring, line: Line, error: PinError) -> String {
    let pin = pin_of(wiring, line);
    let board = wiring.board;
    match error {
        PinError::Missing => format!("puts {line} at GP{pin}, which {board} does not have"),
        PinError::Taken => {
            let to = Board::of(board).and_then(|board| board.taken(pin)).unwrap_or_default();
            format!("puts {line} at GP{pin}, which {board} uses itself: {to}")
        }
        PinError::NoUart => format!("puts {line} at GP{pin}, where {board} does not have it"),
        PinError::Twice => {
            let user = other_line(wiring, line);
            let user = user.map_or_else(|| "the drivers".to_owned(), |user| user.to_string());
            format!("puts {line} at GP{pin}, where {user} is too")
        }
    }
}
