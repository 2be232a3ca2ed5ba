//! Command lines that a person mistypes: what the answer says, and that nothing moves.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::process::Command;

use crate::common::{Emulator, folder, json, patient, plumb, program, refusal, rig_file, stderr};

#[test]
fn a_wrong_command_line_is_told_with_what_is_allowed() {
    let folder = folder();
    for (arguments, says) in [
        (&["check", "--ye"][..], "unexpected argument '--ye' found"),
        (&["run", "--detector", "bal"], "[possible values: ball, disc, red]"),
        (&["simulate"], "unrecognized subcommand 'simulate'"),
        (&["board", "stauts"], "unrecognized subcommand 'stauts'"),
        (&["version"], "unrecognized subcommand 'version'"),
        (&["cosim", "--loop"], "unexpected argument '--loop' found"),
        (&["cameras", "--rig", "rig.toml"], "unexpected argument '--rig' found"),
        (&["emulate", "--driver", "hot"], "unexpected argument '--driver' found"),
        (&["hold", "--timeout", "9"], "`timeout -s INT 9 plumb hold` ends it"),
        (&["demo", "--speed", "0.1"], "arguments were not provided:\n  --follow <WHAT>"),
        (&["init", "--sides", "0.6,", "0.8,", "0.9"], "must be a number, 0.2 to 3.5 m"),
        (&["demo", "--follow", "eight", "--speed", "50mm"], "must be a number, above 0, to 2 m/s"),
        (&["run", "--baud", "115200baud"], "must be a whole number, 300 to 20000000 bit/s"),
        (&["run", "--port", ""], "--port <PORT>': name a port, such as /dev/ttyACM0"),
        (&["board", "status", "--port="], "--port <PORT>': name a port, such as /dev/ttyACM0"),
        (&["run", "--timeout", "2min"], "must be a number, above 0, to 1e9 s"),
        (&["init", "--microsteps", "1/16"], "must be a whole number, 1 to 16 microsteps"),
        (&["emulate", "--lost", "5"], "5 must be 0 to 1"),
        (&["demo", "--seed", "1e3"], "must be a whole number, 0 to 1e15"),
    ] {
        let text = refusal(arguments, folder.path());
        assert!(text.contains(says), "{text}");
    }
    let port = refusal(&["demo", "--page", "--page-address", "99999"], folder.path());
    assert!(port.contains("give an IP address, a port or both"), "{port}");
}

/// Rig file and port are at hand: a line that is accepted would move the motors.
#[test]
fn nothing_moves_after_a_wrong_command_line() {
    let folder = folder();
    let _rig = rig_file(folder.path(), patient);
    fs::write(folder.path().join("way.csv"), "0.4,0.3,0.2\n").unwrap();
    let link = folder.path().join("board");
    let emulator = Emulator::start_with(&["--link", link.to_str().unwrap()]);
    let in_folder = |arguments: &[&str]| {
        program(arguments, folder.path()).env("PLUMB_PORT", &emulator.port).output().unwrap()
    };
    for line in [
        "rig.toml",
        "way.csv",
        "circle",
        "0.6,0.25,0.3",
        "status",
        "flash",
        "control --json",
        "run rig.toml",
        "run way.csv",
        "run circle",
        "run board",
        "run /dev/ttyACM0",
        "run 0.6 0.25 0.3",
        "run 0.6,0.25,0.3",
        "run -0.6,0.25,0.3",
        "run 0.6;0.25;0.3",
        "run --rig",
        "run --rig=",
        "run --rig .",
        "run --rig board",
        "run --rig circle",
        "run --rig way.csv",
        "run --rig rig.toml --rig rig.toml",
        "run --path circle",
        "follow",
        "follow 0.6,0.25,0.3",
        "follow eight way.csv",
        "run --timeout 30 s",
        "run --timeout=30 s",
        "follow eight --centre 0.5 0.2 0.3",
        "follow eight --centre 0.5, -0.2, 0.3",
        "goto rig.toml 0.4 0.4 0.15",
        "goto 0.4 0.4 0.15 rig.toml",
        "goto 0.62 0.26 0.36 0.4",
        "goto 0.62 0.26",
        "goto 0.6,0.25,0.3",
        "goto -0.6,0.25,0.3",
        "goto 650 300 400",
        "goto 40 30 20 cm",
        "goto 1 1 1 /dev/ttyACM0",
        "goto circle",
        "goto way.csv",
        "hold 5",
        "hold board",
        "home A",
        "home rig.toml",
        "jog rig.toml A 200",
        "jog A 200 rig.toml",
        "jog -20 A",
        "jog board",
        "jog A 10cm",
        "jog A 10 cm",
        "check circle",
        "check way.csv",
        "check rig.toml --yes",
        "check board --yes",
        "stop board",
        "clear board",
        "clear rig.toml",
        "board save rig.toml",
        "board status rig.toml",
        "board status rig.toml 0.4",
        "board status ttyACM0",
        "board flash board",
        "board flash /dev/ttyACM0",
        "emulate board",
        "emulate rig.toml",
        "emulate --port x",
        "cosim rig.toml",
        "cosim /dev/ttyACM0",
        "demo rig.toml",
        "demo circle",
        "demo way.csv",
        "demo 0.4 0.2 0.1",
        "demo --rig rig.toml",
        "demo --port x",
        "demo --follow eight --size 20 cm",
        "demo --follow eight --timeout 9 circle",
        "replay --rig rec/rig.toml rec",
        "cameras --rig rig.toml",
    ] {
        let output = in_folder(&line.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(2), "{line}: {}", stderr(&output));
    }
    for place in ["650 -300 40", "[0.6; 0.25; 0.3]", ""] {
        let output = in_folder(&["goto", place]);
        assert_eq!(output.status.code(), Some(2), "{place}: {}", stderr(&output));
    }
    assert_eq!(json(&in_folder(&["board", "status", "--json"]))["state"], "unconfigured");
}

#[test]
fn the_usage_has_options_and_what_is_needed() {
    let folder = folder();
    let help = String::from_utf8(plumb(&["run", "--help"], folder.path()).stdout).unwrap();
    assert!(help.contains("Usage: plumb run [OPTIONS]\n"), "{help}");
}

#[test]
fn a_word_that_is_no_text_does_not_hide_the_mistake() {
    let folder = folder();
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.args(["run", "--out"]).arg(OsStr::from_bytes(b"run-\xff"));
    let output = command.env("PLUMB_RIG", "gone.toml").current_dir(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("gone.toml: no such file (PLUMB_RIG)"), "{}", stderr(&output));
}
