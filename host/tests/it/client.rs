//! The client in Python, written from the page on the wire format alone, against the emulated
//! board.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::Path;
use std::process::Command;

use crate::common::{Emulator, stderr};

/// Runs the client at a board, over the link that `wire` describes; what it prints last.
fn last_line(emulator: &Emulator, wire: &[&str]) -> Option<String> {
    let client = Path::new(env!("CARGO_MANIFEST_DIR")).join("../protocol/examples/client.py");
    let output = match Command::new("python3").arg(client).arg(&emulator.port).output() {
        Ok(output) => output,
        Err(error) => {
            assert!(std::env::var_os("CI").is_none(), "python3: {error}");
            println!("skipped: python3 cannot be started: {error}");
            return None;
        }
    };
    assert!(output.status.success(), "{wire:?}: {}", stderr(&output));
    Some(String::from_utf8_lossy(&output.stdout).lines().last().unwrap_or_default().to_owned())
}

#[test]
fn a_client_in_python_jogs_a_motor_also_over_a_link_that_loses_frames() {
    for wire in [&[][..], &["--baud", "115200", "--lost", "0.1", "--damaged", "0.05"]] {
        let emulator = Emulator::start_with(wire);
        // The second time it begins where the first one has left the motor.
        for steps in ["10.0", "20.0"] {
            let Some(line) = last_line(&emulator, wire) else { return };
            let motors = format!("'motors_steps': [{steps}, 0.0, 0.0]");
            assert!(line.contains(&motors), "{wire:?}: {line}");
            assert!(
                line.contains("'state': 'ready'") && line.contains("'configuration': 5"),
                "{wire:?}: {line}"
            );
        }
    }
}
