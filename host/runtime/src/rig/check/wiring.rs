//! Wirings that the board refuses, by the keys of the rig file.

use plumb_protocol::boards::Board;
use plumb_protocol::wiring::{Line, PinError, Wiring, WiringError};

use super::{Document, Finding, Severity};

/// Returns the finding about a wiring that the board refuses for `error`.
pub(super) fn finding(document: &Document<'_>, wiring: &Wiring, error: &WiringError) -> Finding {
    let (key, problem) = match error {
        WiringError::Board => ("board.kind", "names a board that this one is not".to_owned()),
        WiringError::Drivers => (
            "motors.driver",
            format!("does not fit {}, which has drivers of its own", wiring.board),
        ),
        WiringError::Pin(line, error) => (key(*line), problem(wiring, *line, *error)),
    };
    document.finding(Severity::Error, &[key], problem)
}

/// Returns the key that a line's pin follows from.
pub(super) fn key(line: Line) -> &'static str {
    match line {
        Line::Step(_) => "board.pins.step",
        Line::Direction(_) => "board.pins.direction",
        Line::Enable(_) => "board.pins.enable",
        Line::Emergency => "board.pins.emergency",
        Line::Led => "board.pins.led",
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
        PinError::Twice => {
            let user = wiring.lines().find(|(other, at)| *other != line && *at == pin);
            let user = user.map_or_else(|| "the drivers".to_owned(), |(user, _)| user.to_string());
            format!("puts {line} at GP{pin}, where {user} is too")
        }
    }
}
