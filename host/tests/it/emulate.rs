//! `plumb emulate` behind several commands: one simulated rig, waypoints, a hold, and the motor
//! positions for an outside simulator.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::io::{BufRead, BufReader, PipeReader, Read};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use nix::fcntl::{FcntlArg, fcntl};
use nix::sys::signal::Signal;
use serde_json::Value;

use crate::common::{self, Emulator, folder, json, patient, plumb, rig_file, send, stderr};

#[test]
fn four_gotos_in_a_row_end_at_the_fourth_target() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let mut emulator = Emulator::start_with(&["--rig", &rig]);
    let targets = [
        ["0.40", "0.40", "0.15"],
        ["0.52", "0.30", "0.30"],
        ["0.42", "0.36", "0.20"],
        ["0.54", "0.28", "0.40"],
    ];
    for (number, [x, y, z]) in targets.into_iter().enumerate() {
        let out = number.to_string();
        let goto =
            ["goto", "--rig", &rig, x, y, z, "--law", "taut", "--port", &emulator.port, "--json"];
        let output = plumb(&[&goto as &[&str], &["--out", &out]].concat(), folder.path());
        assert_eq!(output.status.code(), Some(0), "goto {number}: {}", stderr(&output));
    }
    // The ball begins where the goto before has left it, 0.25 m at most from the target.
    let first = std::fs::read_to_string(folder.path().join("3/run.csv")).unwrap();
    let row: Vec<&str> = first.lines().nth(1).unwrap().split(',').collect();
    let coordinates = row[6..9].iter().map(|field| field.parse::<f64>().unwrap());
    for (seen, target) in coordinates.zip([0.42, 0.36, 0.20]) {
        assert!((seen - target).abs() < 0.02, "the first picture: {:?}", &row[6..9]);
    }
    send(&emulator.child, Signal::SIGTERM);
    let mut rest = String::new();
    emulator.child.stdout.as_mut().unwrap().read_to_string(&mut rest).unwrap();
    let end: Value = serde_json::from_str(rest.trim()).unwrap();
    for (ball, target) in end["ball"].as_array().unwrap().iter().zip([0.54, 0.28, 0.40]) {
        assert!((ball.as_f64().unwrap() - target).abs() < 0.015, "the true ball: {end}");
    }
}

/// Starts `plumb emulate --motors`, whose standard output is this pipe. Returns its port.
fn emulate_motors() -> (Child, String, BufReader<PipeReader>) {
    let (reader, writer) = std::io::pipe().unwrap();
    fcntl(&writer, FcntlArg::F_SETPIPE_SZ(4096)).unwrap();
    let child = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(["emulate", "--motors"])
        .stdout(writer)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (mut lines, mut port) = (BufReader::new(reader), String::new());
    lines.read_line(&mut port).unwrap();
    (child, port.trim().to_owned(), lines)
}

#[test]
fn motor_positions_come_every_five_milliseconds() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let (child, port, mut lines) = emulate_motors();
    let reader = thread::spawn(move || {
        let mut text = String::new();
        lines.read_to_string(&mut text).unwrap();
        text
    });
    let jog = plumb(&["jog", "--rig", &rig, "B", "-7.5", "--port", &port], folder.path());
    assert_eq!(jog.status.code(), Some(0), "{}", stderr(&jog));
    thread::sleep(Duration::from_millis(200));
    send(&child, Signal::SIGTERM);
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(0));
    let text = reader.join().unwrap();
    for (number, line) in text.lines().enumerate() {
        let sample: Value = serde_json::from_str(line).unwrap();
        let time = sample["t"].as_f64().unwrap();
        assert!((time - 0.005 * (number + 1) as f64).abs() < 1e-9, "line {number}: {line}");
    }
    assert_eq!(text.lines().next(), Some(r#"{"t": 0.005, "motors": [0.0, 0.0, 0.0]}"#));
    let last = text.lines().last().unwrap();
    assert!(last.ends_with(r#", "motors": [0.0, -7.5, 0.0]}"#), "{last}");
}

#[test]
fn a_slow_reader_of_motor_positions_never_stalls_the_board() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let (child, port, lines) = emulate_motors();
    // Nobody reads for 4 s: the pipe and the queue are full after 3 s at the latest.
    thread::sleep(Duration::from_secs(4));
    let jog = plumb(&["jog", "--rig", &rig, "A", "20", "--port", &port], folder.path());
    assert_eq!(jog.status.code(), Some(0), "{}", stderr(&jog));
    send(&child, Signal::SIGTERM);
    let output = child.wait_with_output().unwrap();
    drop(lines);
    assert!(stderr(&output).contains("lines of motor positions dropped"), "{}", stderr(&output));
}

/// Starts a run in the background, which a test interrupts.
fn start(arguments: &[&str], folder: &std::path::Path) -> Child {
    Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

#[test]
fn a_run_along_waypoints_has_a_leg_for_each() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    let run = |text: &str, out: &str| {
        std::fs::write(folder.path().join("way.csv"), text).unwrap();
        let run = ["follow", "--rig", &rig, "way.csv", "--port", &emulator.port, "--json"];
        plumb(&[&run as &[&str], &["--out", out]].concat(), folder.path())
    };
    let output = run(
        "x,y,z,dwell,tolerance\n0.50,0.28,0.40\n0.46,0.30,0.38,1.0,0.008\n0.5,0.28,0.4,,0.05\n",
        "run",
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let line = json(&output);
    let legs = line["legs"].as_array().unwrap();
    assert_eq!(legs.len(), 3, "{line}");
    assert!(legs.iter().all(|leg| leg["reached"] == true), "{line}");
    assert!(legs[1]["filtered_error_mm"].as_f64().unwrap() <= 8.0, "{line}");
    // The second leg has a dwell time of 30 frames, the third one a tolerance of 5 cm.
    let frames = |leg: usize| legs[leg]["frames"].as_u64().unwrap();
    assert!(frames(1) > 30 && frames(2) < frames(1), "{line}");

    let wrong = run("x,y,z,dwell\n0.46,0,30,0.38,1,1\n", "wrong");
    assert_eq!(wrong.status.code(), Some(2), "{}", stderr(&wrong));
    assert!(stderr(&wrong).contains("way.csv:2: 6 columns"), "{}", stderr(&wrong));
    let outside = run("x,y,z,dwell\n0.50,0.28,0.40\n0.46,0.30,3.0\n", "outside");
    assert_eq!(outside.status.code(), Some(2), "{}", stderr(&outside));
    assert!(!folder.path().join("outside").exists(), "nothing was run");
}

#[test]
fn waypoints_are_repeated_until_an_interrupt() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    std::fs::write(folder.path().join("way.csv"), "x,y,z,dwell\n0.52,0.26,0.42\n0.5,0.28,0.4\n")
        .unwrap();
    let mut run = start(
        &[
            "follow",
            "--rig",
            &rig,
            "way.csv",
            "--loop",
            "--port",
            &emulator.port,
            "--json",
            "--out",
            "run",
        ],
        folder.path(),
    );
    let rows = || std::fs::read_to_string(folder.path().join("run/run.csv")).unwrap_or_default();
    // The first target again, after the second one.
    let is_repeated = || {
        let rows = rows();
        let targets: Vec<&str> = rows.lines().filter_map(|row| row.split(',').nth(9)).collect();
        let second = targets.iter().position(|target| *target == "0.5");
        second.is_some_and(|second| targets[second..].contains(&"0.52"))
    };
    while !is_repeated() && run.try_wait().unwrap().is_none() {
        thread::sleep(Duration::from_millis(50));
    }
    send(&run, Signal::SIGTERM);
    let output = run.wait_with_output().unwrap();
    let line = json(&output);
    assert_eq!(line["ending"], "interrupted", "{line}");
    assert!(line["legs"].as_array().unwrap().len() >= 3, "{line}");
    // A run that is repeated ends like this.
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

#[test]
fn a_hold_keeps_the_ball_where_it_is_until_an_interrupt() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    let mut hold = start(
        &["hold", "--rig", &rig, "--port", &emulator.port, "--json", "--out", "run"],
        folder.path(),
    );
    // Also before the board holds it.
    common::until_rows(&mut hold, &folder.path().join("run"), 3);
    send(&hold, Signal::SIGTERM);
    let output = hold.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let line = json(&output);
    // The start of the simulated rig.
    let target = line["legs"][0]["target_m"].as_array().unwrap();
    for (held, start) in target.iter().zip([0.540, 0.220, 0.459]) {
        assert!((held.as_f64().unwrap() - start).abs() < 0.01, "{line}");
    }
}

#[test]
fn a_rig_file_of_the_environment_and_a_seed_without_losses_do_not_reach_an_emulated_board() {
    let seeded = plumb(&["emulate", "--link-seed", "3", "--json"], &std::env::temp_dir());
    assert_eq!(seeded.status.code(), Some(2), "{}", stderr(&seeded));
    assert!(stderr(&seeded).contains("add --lost or --damaged"), "{}", stderr(&seeded));
    let mut child = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(["emulate", "--json", "--lost", "0.1", "--link-seed", "3"])
        .env("PLUMB_RIG", "absent.toml")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (mut lines, mut port) = (BufReader::new(child.stdout.take().unwrap()), String::new());
    lines.read_line(&mut port).unwrap();
    send(&child, Signal::SIGTERM);
    let mut end = String::new();
    lines.read_to_string(&mut end).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let end: Value = serde_json::from_str(&end).unwrap();
    assert!(end["ball"].is_null(), "a board without a rig: {end}");
    let mut messages = String::new();
    child.stderr.take().unwrap().read_to_string(&mut messages).unwrap();
    assert_eq!(messages, "", "a board in the background writes nothing");
}
