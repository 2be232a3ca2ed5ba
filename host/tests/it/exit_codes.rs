//! The exit codes are those of the error, whatever the command.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::Path;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::common::{Emulator, folder, json, plumb, rig_file, stderr};

/// Exit codes of the commands that speak to a board, at this port.
fn codes(port: &str) -> Vec<Option<i32>> {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let commands: [&[&str]; 7] = [
        &["run", "--rig", &rig, "--port", port, "--out", "run"],
        &["goto", "--rig", &rig, "0.4", "0.4", "0.15", "--port", port, "--out", "goto"],
        &["board", "status", "--port", port],
        &["board", "save", "--rig", &rig, "--port", port],
        &["jog", "--rig", &rig, "A", "10", "--port", port],
        &["stop", "--port", port],
        &["clear", "--rig", &rig, "--port", port],
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
    assert_eq!(codes, [Some(1); 7]);
}

#[test]
fn an_absent_port_is_bad_input_for_every_command() {
    assert_eq!(codes("/dev/absent"), [Some(2); 7]);
}

/// Returns the error in the last line of standard output, which is JSON.
fn json_error(arguments: &[&str], folder: &Path, code: i32) -> String {
    let output = plumb(arguments, folder);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", stderr(&output));
    let line = json(&output);
    assert_eq!(line["exit_code"], code, "{arguments:?}: {line}");
    line["error"].as_str().unwrap().to_owned()
}

#[test]
fn a_command_that_fails_without_a_result_prints_its_error_as_json() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let absent = "/dev/absent";
    let cases: [(&[&str], &str); 8] = [
        (&["run", "--rig", &rig, "--port", absent, "--json"], "no such serial port"),
        (&["run", "--rig", "absent.toml", "--json"], "absent.toml"),
        (&["run", "--rig", &rig, "--timeout", "-3", "--json"], "--timeout"),
        (&["run", "--json", "--unknown"], "--unknown"),
        (&["board", "status", "--port", absent, "--json"], "no such serial port"),
        (&["board", "save", "--rig", &rig, "--port", absent, "--json"], "no such serial port"),
        (&["board", "flash", "absent.uf2", "--json"], "absent.uf2: cannot be read: No such file"),
        // The demo always ends with a line of JSON.
        (&["demo", "--law", "sign", "--gamma", "999"], "--gamma"),
    ];
    for (arguments, named) in cases {
        let error = json_error(arguments, folder.path(), 2);
        assert!(error.contains(named), "{arguments:?}: {error}");
    }
    let quiet = plumb(&["run", "--rig", "absent.toml"], folder.path());
    assert!(quiet.stdout.is_empty(), "no JSON without --json");
}

#[test]
fn an_emulated_board_has_no_bootloader() {
    let (folder, emulator) = (folder(), Emulator::start());
    let firmware = plumb_image::uf2::file(&plumb_image::chip::RP2040, &[0; 256]);
    std::fs::write(folder.path().join("plumb.uf2"), firmware).unwrap();
    for command in [&["bootloader"] as &[&str], &["flash", "plumb.uf2"]] {
        let port = ["--port", &emulator.port, "--json"];
        let error = json_error(&[&["board"], command, &port].concat(), folder.path(), 1);
        assert!(error.contains("not restarted into its bootloader"), "{error}");
        // It is of use as before.
        let status = plumb(&["board", "status", "--port", &emulator.port], folder.path());
        let text = stderr(&status);
        assert!(text.contains("unconfigured") && text.contains("a requested restart"), "{text}");
    }
}

#[test]
fn an_option_without_effect_is_bad_input() {
    let folder = folder();
    // Without a rig file the emulated board moves no rig.
    let error = json_error(&["emulate", "--physics", "elastic", "--json"], folder.path(), 2);
    assert!(error.contains("--rig"), "{error}");
}

#[test]
fn a_recording_without_a_camera_file_names_the_option() {
    let folder = folder();
    std::fs::write(folder.path().join("rgb.txt"), "").unwrap();
    let error = json_error(&["replay", ".", "--json"], folder.path(), 2);
    assert!(error.contains("--camera"), "{error}");
    let error = json_error(&["replay", "absent.oni", "--json"], folder.path(), 2);
    assert!(error.contains("no such recording"), "{error}");
}

#[test]
fn physics_without_a_simulated_rig_is_bad_input() {
    let folder = folder();
    let rig =
        rig_file(folder.path(), |text| text.replace("[camera]", "[camera]\nsource = \"openni\""));
    let output = plumb(&["run", "--rig", &rig, "--physics", "elastic"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("--physics"), "{}", stderr(&output));
}
