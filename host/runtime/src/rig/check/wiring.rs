//! Findings about the wiring of the board.

use plumb_config::toml_file::place;
use plumb_protocol::boards::Board;
use plumb_protocol::wiring::{Drivers, PinError, Wiring, WiringError};

use crate::rig::document::{Document, Finding, Severity};
use crate::rig::refused_wiring::{self, other_line, refusal};
use crate::rig::{Driver, OutOfRange, Rig, TMC2209_STRAPS};

/// Returns the finding about the wiring of `rig`, which the board refuses for `error`.
pub(super) fn finding(
    document: &Document<'_>,
    rig: &Rig,
    wiring: &Wiring,
    error: WiringError,
) -> Finding {
    let OutOfRange { key, why, .. } = refusal(&rig.motors, wiring, error);
    match error {
        WiringError::Pin(line, PinError::Twice) if place(document.text, key).is_none() => {
            let other = other_line(wiring, line).map_or(key, refused_wiring::key);
            let why =
                format!("{why}; this is the default of `{key}`, which the file does not have");
            document.finding(Severity::Error, &[key, other], why)
        }
        _ => document.finding(Severity::Error, &[key], why),
    }
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

/// Returns the warning about microsteps that no straps of a TMC2209 without its UART give. The
/// board takes them, and each distance and rate is then wrong by a factor.
pub(super) fn strapped(document: &Document<'_>, rig: &Rig) -> Option<Finding> {
    let is_strapped = matches!(rig.motors.driver, Driver::Tmc2209);
    if !is_strapped || TMC2209_STRAPS.contains(&rig.motors.microsteps) {
        return None;
    }
    let problem = "is no setting of a TMC2209 without its UART: its straps give 8 or 16 (or 32 and \
                   64, which the board does not drive), and distances and rates are wrong by the \
                   factor between them";
    Some(document.finding(Severity::Warning, &["motors.microsteps"], problem.to_owned()))
}
