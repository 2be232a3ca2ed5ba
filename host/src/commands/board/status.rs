//! The state of a board, for people and as JSON.

use plumb_protocol::diagnostics::{ChipCounts, Diagnostics};
use plumb_protocol::message::{State, Telemetry};
use plumb_protocol::{Provenance, RELEASE};
use plumb_runtime::board_fault::after_fault;
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::link::{Link, Transport};
use plumb_runtime::observer::FrameRecord;
use plumb_runtime::record;
use serde_json::{Value, json};

use crate::cli::exit::{Exit, Failure};
use crate::cli::print::{self, is_quiet};

/// Prints the state of the board, its program and what it has counted.
pub(super) fn tell<T: Transport>(link: &mut Link<T>, is_json: bool) -> Result<Exit, Failure> {
    let (telemetry, provenance) = (link.status()?, link.provenance()?);
    let diagnostics = link.diagnostics()?;
    let port = link.port();
    tell!("{port}: {provenance}; started by {}", diagnostics.start);
    compare_release(&port, &provenance);
    let report = BoardReport::from(&telemetry);
    state(&port, &report);
    if let State::Fault(fault) = telemetry.state {
        tell!("{port}: {} `plumb clear` clears it", after_fault(fault));
    }
    counts(&port, &diagnostics);
    print::json(is_json, whole_line(&port, &report, &provenance, &diagnostics))?;
    Ok(Exit::Done)
}

/// Asks the board for its state, its program and what it has counted, and returns them in JSON.
pub(crate) fn status_line<T: Transport>(link: &mut Link<T>) -> Result<Value, Failure> {
    let (telemetry, provenance) = (link.status()?, link.provenance()?);
    let report = BoardReport::from(&telemetry);
    Ok(whole_line(&link.port(), &report, &provenance, &link.diagnostics()?))
}

/// Returns all that a board tells, in JSON.
fn whole_line(
    port: &str,
    report: &BoardReport,
    provenance: &Provenance,
    diagnostics: &Diagnostics,
) -> Value {
    let mut line = line(port, report);
    line["firmware"] = firmware_line(provenance);
    line["counts"] = chip_counts(diagnostics);
    line
}

/// Says so where the board runs another release than this program.
pub(super) fn compare_release(port: &str, provenance: &Provenance) {
    if provenance.release != RELEASE {
        tell!(
            "{port}: this program is Plumb {RELEASE}: flash the firmware of this release (plumb \
             board flash)"
        );
    }
}

/// Returns the board's program and chip in JSON.
pub(super) fn firmware_line(provenance: &Provenance) -> Value {
    json!({
        "release": provenance.release.to_string(),
        "commit": provenance.commit.map(|commit| commit.to_string()),
        "board": provenance.board.to_string(),
        "stepping": provenance.stepping.map(|name| String::from_iter(name.map(char::from))),
    })
}

/// Returns what the board has counted in JSON.
pub(super) fn chip_counts(diagnostics: &Diagnostics) -> Value {
    let Diagnostics { start, bad_frames, chip, .. } = diagnostics;
    json!({
        "start_cause": start.to_string(),
        "bad_frames": bad_frames,
        "late_ticks": chip.late_ticks,
        "late_at_rest": chip.late_at_rest,
        "free_stack": chip.free_stack,
        "usb_resets": chip.usb_resets,
        "processor_fault": chip.fault.map(|fault| fault.to_string()),
        "dropped_frames": chip.dropped_frames,
    })
}

/// Prints what the board has counted.
fn counts(port: &str, diagnostics: &Diagnostics) {
    let ChipCounts { late_ticks, late_at_rest, free_stack, usb_resets, fault, dropped_frames } =
        diagnostics.chip;
    tell!(
        "{port}: since its start {} damaged frames, {dropped_frames} dropped ones, {late_ticks} \
         late ticks with motors turning, {late_at_rest} at rest, {usb_resets} resets of USB",
        diagnostics.bad_frames
    );
    if let Some(bytes) = free_stack {
        tell!("{port}: {bytes} bytes of its stack were never used");
    }
    if let Some(fault) = fault {
        tell!("{port}: the fault of its processor was {fault}");
    }
}

/// Prints the state of the board for people, and as JSON where that is asked for.
pub(crate) fn report<T: Transport>(
    link: &Link<T>,
    telemetry: &Telemetry,
    is_json: bool,
) -> Result<(), Failure> {
    let port = link.port();
    let report = BoardReport::from(telemetry);
    if !is_quiet() {
        state(&port, &report);
        let BoardReport { bad_frames, late_ticks, .. } = report;
        tell!("{port}: since its start {bad_frames} damaged frames, {late_ticks} late ticks");
    }
    Ok(print::json(is_json, line(&port, &report))?)
}

/// Returns the positions of motors with two digits.
pub(crate) fn positions(motors: &[f64]) -> String {
    motors.iter().map(|at| format!("{at:.2}")).collect::<Vec<_>>().join(", ")
}

/// Prints the state of the board, and where its motors are.
fn state(port: &str, board: &BoardReport) {
    let motors = positions(&board.motors);
    tell!("{port}: {}; motors at {motors} steps from the zero of travel", board.state);
}

/// Returns the telemetry of the board in JSON, with the names that all outputs have.
pub(crate) fn line(port: &str, board: &BoardReport) -> Value {
    let record = FrameRecord { board: Some(*board), ..FrameRecord::default() };
    let mut line = json!(record::telemetry(&record));
    line["port"] = port.into();
    line
}
