//! Wirings that the board refuses, by the keys of the rig file.

use plumb_protocol::boards::Board;
use plumb_protocol::wiring::{Drivers, Line, PinError, Wiring, WiringError};

use super::{Document, Finding, Severity};

/// Returns the finding about a wiring that the board refuses for `error`.
pub(super) fn finding(document: &Document<'_>, wiring: &Wiring, error: &WiringError) -> Finding {
    let (key, problem) = match error {
        WiringError::Board => ("board.kind", "names a board that this one is not".to_owned()),
        WiringError::Drivers => (
            "motors.driver",
            format!("does not fit {}, which has drivers of its own", wiring.board),
        ),
        WiringError::Addresses => (
            "motors.driver.tmc2209-uart.addresses",
            "has an address above 3, or one twice".to_owned(),
        ),
        WiringError::Pin(line, error) => (key(*line), problem(wiring, *line, *error)),
    };
    document.finding(Severity::Error, &[key], problem)
}

/// Returns the warning about a board with drivers of its own that are left without their UART.
pub(super) fn silent_drivers(document: &Document<'_>, wiring: &Wiring) -> Option<Finding> {
    let board = Board::of(wiring.board).filter(|board| !board.has_free_drivers)?;
    matches!(wiring.drivers, Drivers::StepDir(_)).then(|| {
        let problem = format!(
            "leaves the drivers of {} as their address pins set them, each with other microsteps: \
             `driver.tmc2209-uart` sets them all",
            board.kind
        );
        document.finding(Severity::Warning, &["motors.driver"], problem)
    })
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

/// Returns what is wrong with the pin of a line.
fn problem(wiring: &Wiring, line: Line, error: PinError) -> String {
    let pin = wiring.lines().find(|(other, _)| *other == line).map_or(0, |(_, pin)| pin);
    let board = wiring.board;
    match error {
        PinError::Missing => format!("puts {line} at GP{pin}, which {board} does not have"),
        PinError::Taken => {
            let to = Board::of(board).and_then(|board| board.taken(pin)).unwrap_or_default();
            format!("puts {line} at GP{pin}, which {board} uses itself: {to}")
        }
        PinError::NoUart => format!("puts {line} at GP{pin}, where {board} does not have it"),
        PinError::Twice => {
            let user = wiring.lines().find(|(other, at)| *other != line && *at == pin);
            let user = user.map_or_else(|| "the drivers".to_owned(), |(user, _)| user.to_string());
            format!("puts {line} at GP{pin}, where {user} is too")
        }
    }
}
