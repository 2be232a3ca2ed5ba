//! The exit codes are those of the error, whatever the command.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod common;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use common::{Emulator, folder, plumb, rig_file, stderr};

/// Exit codes of the commands that speak to a board, at this port.
fn codes(port: &str) -> Vec<Option<i32>> {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let commands: [&[&str]; 4] = [
        &["run", &rig, "--port", port, "--out", "run"],
        &["goto", "0.4", "0.4", "0.15", "--rig", &rig, "--port", port, "--out", "goto"],
        &["board", "status", "--port", port],
        &["board", "save", &rig, "--port", port],
    ];
    commands
        .iter()
        .map(|arguments| {
            let output = plumb(arguments, folder.path());
            println!("{arguments:?}: {}", stderr(&output));
            output.status.code()
        })
        .collect()
}

#[test]
fn a_silent_board_is_a_failure_for_every_command() {
    let emulator = Emulator::start();
    let board = Pid::from_raw(i32::try_from(emulator.child.id()).unwrap());
    kill(board, Signal::SIGSTOP).unwrap();
    let codes = codes(&emulator.port);
    kill(board, Signal::SIGCONT).unwrap();
    assert_eq!(codes, [Some(1); 4]);
}

#[test]
fn an_absent_port_is_bad_input_for_every_command() {
    assert_eq!(codes("/dev/absent"), [Some(2); 4]);
}

#[test]
fn physics_without_a_simulated_rig_is_bad_input() {
    let folder = folder();
    let rig =
        rig_file(folder.path(), |text| text.replace("[camera]", "[camera]\nsource = \"openni\""));
    let output = plumb(&["run", &rig, "--physics", "elastic"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("--physics"), "{}", stderr(&output));
}
