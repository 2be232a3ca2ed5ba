//! `plumb run` over links that take time, lose frames, break, or lead to a board that restarts:
//! what it reports, and its exit code.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use tempfile::TempDir;

use crate::common::{Emulator, folder, json, patient, plumb, rig_file, stderr, until_rows};

/// Three targets, each 12 cm or more from the one before.
const TARGETS: &str = "targets = [[0.40, 0.40, 0.15], [0.52, 0.30, 0.30], [0.42, 0.36, 0.20]]";

/// A run under way behind an emulated board.
struct Run {
    folder: TempDir,
    emulator: Emulator,
    child: Child,
}

impl Run {
    /// Starts `plumb run` with the board that `options` of `plumb emulate` describe.
    fn start(options: &[&str]) -> Self {
        Self::start_with("\"a4988\"", options)
    }

    /// The same with these drivers in the rig file.
    fn start_with(driver: &str, options: &[&str]) -> Self {
        let folder = folder();
        let rig = rig_file(folder.path(), |text| {
            let text = patient(text).replace("\"a4988\"", driver);
            text.lines()
                .map(|line| if line.starts_with("targets") { TARGETS } else { line })
                .fold(String::new(), |text, line| text + line + "\n")
        });
        let emulator = Emulator::start_with(options);
        let child = Command::new(env!("CARGO_BIN_EXE_plumb"))
            .args([
                "run",
                "--rig",
                &rig,
                "--port",
                &emulator.port,
                "--law",
                "sign",
                "--json",
                "--out",
                "run",
            ])
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        Self { folder, emulator, child }
    }

    /// Waits for its end.
    fn end(self) -> (Output, Value) {
        let (output, line, _) = self.end_before();
        (output, line)
    }

    /// Waits for its end. Returns the board too, which runs on.
    fn end_before(self) -> (Output, Value, Emulator) {
        let output = self.child.wait_with_output().unwrap();
        let line = json(&output);
        let summary = std::fs::read_to_string(self.folder.path().join("run/summary.json")).unwrap();
        let kept: Value = serde_json::from_str(&summary).unwrap();
        assert_eq!(kept["ending"], line["ending"]);
        (output, line, self.emulator)
    }
}

#[test]
fn every_target_is_driven_to_over_links_that_take_time_or_lose_frames() {
    for wire in [
        &["--baud", "115200"][..],
        &["--frame-time", "0.0003", "--latency", "0.004"],
        &["--frame-time", "0.001", "--lost", "0.1", "--damaged", "0.02"],
    ] {
        let (output, line) = Run::start(wire).end();
        assert_eq!(output.status.code(), Some(0), "{wire:?}: {}", stderr(&output));
        assert!(line["reached"] == true && line["at_rest"] == true, "{wire:?}: {line}");
        let legs = line["legs"].as_array().unwrap();
        assert_eq!(legs.len(), 3, "{wire:?}: {line}");
        for leg in legs {
            let (frames, error) =
                (leg["frames"].as_u64().unwrap(), leg["filtered_error_mm"].as_f64().unwrap());
            assert!(leg["reached"] == true && frames >= 10 && error <= 10.0, "{wire:?}: {line}");
        }
    }
}

#[test]
fn a_slow_link_is_told_before_the_ball_moves() {
    let mut run = Run::start(&["--latency", "0.2"]);
    until_rows(&mut run.child, &run.folder.path().join("run"), 2);
    kill(Pid::from_raw(run.child.id() as i32), Signal::SIGINT).unwrap();
    let text = stderr(&run.end().0);
    assert!(text.contains("the link to the board is slow: an answer takes 0."), "{text}");
}

#[test]
fn a_board_that_restarts_ends_the_run_with_the_cause() {
    // The run takes 8 s. On a busy machine it begins seconds after the board.
    let (output, line) = Run::start(&["--frame-time", "0.001", "--reboot-after", "6"]).end();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(line["reached"] == false && line["at_rest"] == false, "{line}");
    let ending = line["ending"].as_str().unwrap();
    assert!(ending.contains("restarted") && ending.contains("power on"), "{line}");
    let text = stderr(&output);
    let last = text.lines().last().unwrap();
    for part in ["the ball may have fallen", "hang the ball again, then run `plumb home`"] {
        assert!(last.contains(part), "{text}");
    }
    // The error names the port itself.
    assert!(!last.contains("link to the board"), "{text}");
}

#[test]
fn an_emergency_stop_can_be_rehearsed() {
    let (output, line, emulator) = Run::start(&["--emergency-after", "6"]).end_before();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(line["ending"].as_str().unwrap().contains("emergency"), "{line}");
    // The button is pressed for 3 s.
    let texts = cleared(&emulator.port);
    let refused = "(the emergency input opened); close the emergency loop, then clear the fault";
    assert!(texts.iter().all(|text| text.contains(refused)), "{texts:?}");
}

#[test]
fn a_driver_s_fault_can_be_rehearsed() {
    let drivers = "{ tmc2209-uart = { run_current = 0.8 } }";
    let options = ["--driver-trouble", "short", "--driver-trouble-motor", "b"];
    let options = [&options[..], &["--driver-trouble-after", "6"]].concat();
    let (output, line, emulator) = Run::start_with(drivers, &options).end_before();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let ending = line["ending"].as_str().unwrap();
    assert!(ending.contains("motor B has a short circuit"), "{line}");
    // The short circuit lasts for 10 s.
    let texts = cleared(&emulator.port);
    let again = "the board has stopped again: the driver of motor B has a short circuit and has \
                 switched off. Switch the motors' supply off";
    assert!(texts.iter().all(|text| text.contains(again)), "{texts:?}");
}

/// The emergency stop takes the place of the driver's fault, and the driver still fails after it.
#[test]
fn a_clear_of_another_fault_sees_that_a_driver_fails_again() {
    let drivers = "{ tmc2209-uart = { run_current = 0.8 } }";
    let options = ["--driver-trouble", "silent", "--driver-trouble-after", "6"];
    let options = [&options[..], &["--emergency-after", "6.5"]].concat();
    let (output, _, emulator) = Run::start_with(drivers, &options).end_before();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    cleared(&emulator.port);
    let status = plumb(&["board", "status", "--port", &emulator.port], Path::new("."));
    assert!(stderr(&status).contains(": ready; motors at"), "{}", stderr(&status));
}

/// Clears the board's fault until that succeeds. Returns the messages of the attempts before.
fn cleared(port: &str) -> Vec<String> {
    let mut texts = Vec::new();
    loop {
        assert!(texts.len() < 1000, "{}", texts[0]);
        let output = plumb(&["clear", "--port", port], Path::new("."));
        if output.status.success() {
            assert!(stderr(&output).contains("faults are cleared"), "{}", stderr(&output));
            return texts;
        }
        texts.push(stderr(&output));
    }
}

#[test]
fn a_warning_of_a_driver_is_told_in_the_run_and_by_the_rehearsal() {
    let drivers = "{ tmc2209-uart = { run_current = 0.8 } }";
    let options = ["--driver-trouble", "hot", "--driver-trouble-after", "6"];
    let (output, line, mut emulator) = Run::start_with(drivers, &options).end_before();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(line["reached"] == true, "{line}");
    assert!(stderr(&output).contains("warnings of the motor drivers: A hot (cool the driver"));
    kill(Pid::from_raw(emulator.child.id() as i32), Signal::SIGINT).unwrap();
    let mut text = String::new();
    emulator.child.stderr.take().unwrap().read_to_string(&mut text).unwrap();
    let told = "rehearsal, 6.0 s: the driver of motor A has a trouble: hot\n";
    assert!(text.contains(told), "{text}");
}

#[test]
fn a_trouble_of_drivers_that_tell_none_is_refused() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let output = plumb(&["emulate", "--rig", &rig, "--driver-trouble", "hot"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    let text = stderr(&output);
    assert!(text.contains("rig.toml: --driver-trouble has no effect: the drivers"), "{text}");
    assert!(text.contains("not TMC2209 on a UART. Only these tell"), "{text}");
    let output = plumb(&["emulate", "--driver-trouble-after", "5"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
}

/// Without a rig file the emulated board learns its drivers from the host.
#[test]
fn a_trouble_of_drivers_that_the_board_has_not_yet_is_told_with_when_it_shows() {
    let options = ["--driver-trouble", "hot", "--driver-trouble-after", "0.1"];
    let mut emulator = Emulator::start_with(&options);
    let lines = BufReader::new(emulator.child.stderr.take().unwrap()).lines();
    let line = lines.map(Result::unwrap).find(|line| line.starts_with("rehearsal")).unwrap();
    let says = "rehearsal, 0.1 s: the driver of motor A has a trouble: hot. It shows once a host ";
    assert!(line.starts_with(says) && line.contains("run_current = 0.8"), "{line}");
}

/// The board's process is stopped, so that nothing comes from it and nothing is wrong with its
/// port.
#[test]
fn a_board_that_falls_silent_ends_the_run_with_the_cause() {
    let mut run = Run::start(&[]);
    until_rows(&mut run.child, &run.folder.path().join("run"), 20);
    let board = Pid::from_raw(i32::try_from(run.emulator.child.id()).unwrap());
    kill(board, Signal::SIGSTOP).unwrap();
    let rows =
        std::fs::read_to_string(run.folder.path().join("run/run.csv")).unwrap().lines().count();
    let (output, line) = run.end();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(line["ending"].as_str().unwrap().contains("nothing has come from the board"), "{line}");
    // Pictures come 30 times a second, and the deadline of this rig is 5 s.
    let after = line["frames"].as_u64().unwrap() - rows as u64 + 1;
    assert!(after < 240, "{after} rows after the board fell silent");
}
