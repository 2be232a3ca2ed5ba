//! Faults that an earlier command left behind on the board: which of them the next one clears.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{
    CAMERA_AWAY, Emulator, States, folder, json, patient, plumb, rig_file, stderr, until_rows,
};

/// Arguments of the commands that drive, without the rig file.
const DRIVES: [&[&str]; 3] = [&["run"], &["goto", "0.4", "0.4", "0.15"], &["hold"]];

/// Line of a command that has cleared the fault.
const CLEARED: &str =
    "an earlier run left the board in a fault, cleared: nothing came from the host for too long";

/// Returns a rig file's text with a deadline for a silent host that a busy machine keeps, below
/// that for positions, and motors that move the ball little in that time.
fn slow(text: String) -> String {
    patient(text).replace("host = 5.0", "host = 4.5").replace("max_rate = 400.0", "max_rate = 10.0")
}

/// Returns a rig file's text whose run ends because no picture shows the ball, also on a busy
/// machine.
fn blind(text: String) -> String {
    text.replace("host = 0.3", "host = 5.0") + CAMERA_AWAY
}

/// Returns the whole command line of `drive`, with results in the folder `out`.
fn arguments<'a>(drive: &[&'a str], rig: &'a str, port: &'a str, out: &'a str) -> Vec<&'a str> {
    [drive, &["--rig", rig, "--port", port, "--json", "--out", out]].concat()
}

/// Starts a drive in the background, and kills it once it has sent ten positions. Returns its
/// messages.
fn killed(arguments: &[&str], folder: &Path, out: &str) -> String {
    let mut drive = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    until_rows(&mut drive, &folder.join(out), 10);
    let ended = drive.try_wait().unwrap();
    drive.kill().unwrap();
    let text = stderr(&drive.wait_with_output().unwrap());
    assert_eq!(ended, None, "{arguments:?}: {text}");
    text
}

#[test]
fn a_drive_clears_the_fault_that_a_killed_one_left_behind_and_says_so() {
    let folder = folder();
    let rig = rig_file(folder.path(), slow);
    let mut emulator = Emulator::start();
    let mut states = States::of(&mut emulator.child);
    for (number, drive) in DRIVES.into_iter().chain([DRIVES[0]]).enumerate() {
        if number > 0 {
            let state = states.wait_for("fault");
            assert!(state.contains("nothing came from the host"), "{state}");
        }
        let out = number.to_string();
        let text = killed(&arguments(drive, &rig, &emulator.port, &out), folder.path(), &out);
        let is_cleared = text.split_inclusive('\n').any(|line| line == format!("{CLEARED}\n"));
        assert_eq!(is_cleared, number > 0, "{drive:?}: {text}");
    }
}

#[test]
fn a_drive_refuses_any_other_fault() {
    let folder = folder();
    let rig = rig_file(folder.path(), blind);
    let emulator = Emulator::start();
    let lost = plumb(&arguments(DRIVES[0], &rig, &emulator.port, "lost"), folder.path());
    assert_eq!(lost.status.code(), Some(1), "{}", stderr(&lost));
    let ending = json(&lost)["ending"].as_str().unwrap().to_owned();
    assert!(ending.contains("no fresh position of the ball"), "{ending}");
    let status = || {
        let status = plumb(&["board", "status", "--port", &emulator.port, "--json"], folder.path());
        json(&status)["fault"].as_str().unwrap().to_owned()
    };
    let state = status();
    assert!(state.contains("no fresh position of the ball"), "{state}");
    for drive in DRIVES {
        let output = plumb(&arguments(drive, &rig, &emulator.port, "refused"), folder.path());
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{drive:?}: {text}");
        let clear = format!("Run `plumb clear --rig {rig} --port {}`, then this", emulator.port);
        assert!(text.contains(&clear), "{drive:?}: {text}");
        assert!(!text.contains("cleared"), "{drive:?}: {text}");
        assert!(!folder.path().join("refused").exists(), "{drive:?}: nothing was run");
        assert_eq!(status(), state, "{drive:?}");
    }
    // Before the check asks for a yes.
    let check = plumb(&["check", "--rig", &rig, "--port", &emulator.port], folder.path());
    let text = stderr(&check);
    assert_eq!(check.status.code(), Some(1), "{text}");
    let end =
        format!("`plumb clear --rig {rig} --port {}`, then this command again", emulator.port);
    let end = format!("begin again. Nothing has moved. Run {end}");
    assert!(text.trim_end().ends_with(&end) && !text.contains("yes"), "{text}");
}
