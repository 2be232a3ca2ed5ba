//! What `plumb init` says about the files that it has written: notes, and what to do next.

use std::path::Path;

use plumb_config::book::page;
use plumb_setup::new_rig::{DriverKind, NewCamera, NewRig};

use crate::cli::rig_path::{quoted, rig_option};

/// Returns what a person must know of the board and its drivers before they get current.
pub(super) fn notes(rig: &NewRig) -> Vec<String> {
    let mut notes = driver_notes(rig);
    if rig.board.board().chip.has_latching_inputs() {
        notes.push(format!(
            "inputs of an RP2350 may stay at about 2 V with the chip's pull-downs: resistors to \
             ground must be 8.2 kΩ or less ({})",
            page("pico2")
        ));
    }
    notes
}

/// Returns what a person must know of the drivers before they get current.
fn driver_notes(rig: &NewRig) -> Vec<String> {
    match rig.driver {
        DriverKind::Tmc2209Uart => uart_notes(rig),
        DriverKind::Tb6600 | DriverKind::Dm542 => vec![format!(
            "a current switches these drivers off, so that a crash of the board leaves the motors \
             on; they need a 5 V buffer ({})",
            page("opto")
        )],
        DriverKind::Coils | DriverKind::MotorHats => vec![format!(
            "`duty` 0.8 is a guess, and H-bridges limit no current: the supply's voltage times \
             `duty`, divided by the resistance of a coil, must not be above the motor's current. \
             12 V · 0.8 / 2 Ω are 4.8 A ({})",
            page("board")
        )],
        DriverKind::A4988 | DriverKind::Drv8825 | DriverKind::Tmc2209 => Vec::new(),
    }
}

/// Returns the notes about TMC2209 on a UART. A board with drivers of its own has their addresses.
fn uart_notes(rig: &NewRig) -> Vec<String> {
    let page = page("uart-drivers");
    let has_modules = rig.board.board().has_free_drivers;
    let current = format!("0.8 A is a guess: set `run_current` to the motors' data sheet ({page})");
    let place = if has_modules { "on each module" } else { "at each driver" };
    let resistor = format!(
        "the current follows from the sense resistors, the two large resistors {place}: R110 is \
         0.11 Ω, as the program takes it; for R150 add `sense_resistor = 0.15` beside \
         `run_current` ({page})"
    );
    let addresses = has_modules.then(|| {
        format!(
            "each driver takes its address from its straps: of motor A MS1 and MS2 low, of B MS1 \
             high, of C MS2 high ({page})"
        )
    });
    [current, resistor].into_iter().chain(addresses).collect()
}

/// Returns what to do with the files, for a person.
pub(super) fn next_step(new: &NewRig, path: &Path) -> String {
    let rig = rig_option(path.strip_prefix(".").unwrap_or(path));
    if new.camera == NewCamera::Simulated {
        return format!(
            "`plumb emulate --link board &`, then `plumb run{rig} --port board`; `kill %1` ends \
             the emulated board"
        );
    }
    if let NewCamera::Recording(recording) = &new.camera {
        return format!(
            "read the comments in both files; then
  `plumb check{rig} --file-only` looks for mistakes in them
  `plumb replay {}` shows where the ball is found
  `plumb run{rig}` tries a board: the ball of a recording does not follow its motors",
            quoted(recording)
        );
    }
    let lens = match new.camera {
        NewCamera::Webcam | NewCamera::Stream(_) => {
            format!("\n  `plumb calibrate{rig} --lens` finds the lens of the camera")
        }
        NewCamera::Openni => format!(
            "\n  `plumb calibrate{rig} --lens` finds the lens of the camera; or let the camera \
             name it, by\n    `openni.intrinsics = \"device\"` below [camera] of the rig file"
        ),
        _ => String::new(),
    };
    format!(
        "read the comments in both files; then
  `plumb check{rig} --file-only` looks for mistakes in them
  `plumb board flash{rig}` puts the firmware on the board
  `plumb jog{rig}` turns each motor by keys, before a ball hangs on it{lens}
  `plumb calibrate{rig} --board` finds the camera's pose
  `plumb check{rig}` turns each motor a little and names what is wired wrongly"
    )
}
