//! Signals: how they end a run and an emulation.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::symlink;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::Duration;

use nix::pty::openpty;
use nix::sys::signal::Signal;
use nix::sys::termios::{FlowArg, tcflow};

use crate::common::{
    Emulator, States, folder, json, patient, plumb, program, rig_file, send, stderr, until_rows,
};

#[test]
fn signals_end_a_run_with_its_summary() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    for signal in [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP] {
        let name = signal.as_str();
        for (out, start) in [
            (format!("run-{name}"), vec!["run", "--rig", &rig, "--json"]),
            (format!("demo-{name}"), vec!["demo", "--law", "interval"]),
        ] {
            let output = interrupted(&start, &folder.path().join(&out), signal);
            assert_eq!(output.status.code(), Some(1), "{out}: {}", stderr(&output));
            let told = "stopping; Ctrl-C again ends the program at once\n";
            assert_eq!(stderr(&output).matches(told).count(), 1, "{out}: {}", stderr(&output));
            assert_eq!(json(&output)["ending"], "interrupted", "{out}");
            let summary =
                fs::read_to_string(folder.path().join(&out).join("summary.json")).unwrap();
            assert!(summary.contains("interrupted"), "{summary}");
        }
    }
}

/// Sends `signal` to a run after its first rows, and returns what it printed. A run that a busy
/// machine has ended by a fault, as the demo's short deadlines allow, is made again: five at most.
fn interrupted(start: &[&str], out: &Path, signal: Signal) -> Output {
    let arguments = [start, &["--out", out.to_str().unwrap()]].concat();
    for _ in 0..5 {
        let emulator = Emulator::start();
        let mut run = program(&arguments, out.parent().unwrap())
            .env("PLUMB_PORT", &emulator.port)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        until_rows(&mut run, out, 10);
        if run.try_wait().unwrap().is_none() {
            send(&run, signal);
        }
        let output = run.wait_with_output().unwrap();
        if !stderr(&output).contains("overloaded") {
            return output;
        }
        fs::remove_dir_all(out).unwrap();
    }
    panic!("this computer is too busy for {start:?}");
}

/// The board's process is stopped, so that the run waits for its greeting when the signal comes.
#[test]
fn a_signal_before_the_run_begins_leaves_no_run_folder() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    send(&emulator.child, Signal::SIGSTOP);
    let run = ["run", "--rig", &rig, "--port", &emulator.port, "--json", "--out", "run"];
    let run =
        program(&run, folder.path()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    while !catches(&run, Signal::SIGINT) {
        thread::sleep(Duration::from_millis(5));
    }
    send(&run, Signal::SIGINT);
    thread::sleep(Duration::from_millis(100));
    send(&emulator.child, Signal::SIGCONT);
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let why = "interrupted before the run began: nothing was moved";
    assert_eq!(json(&output)["error"], why, "{}", stderr(&output));
    assert!(!folder.path().join("run").exists());
}

/// Returns whether the process has a handler for the signal.
fn catches(process: &Child, signal: Signal) -> bool {
    let status = fs::read_to_string(format!("/proc/{}/status", process.id())).unwrap();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
    u64::from_str_radix(mask.trim(), 16).unwrap() & (1 << (signal as i32 - 1)) != 0
}

/// The board's process is stopped, so that the run waits for it after the first signal.
#[test]
fn a_second_signal_ends_a_run_at_once() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    let mut run =
        program(&["run", "--rig", &rig, "--port", &emulator.port, "--out", "run"], folder.path())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
    until_rows(&mut run, &folder.path().join("run"), 10);
    send(&emulator.child, Signal::SIGSTOP);
    send(&run, Signal::SIGTERM);
    thread::sleep(Duration::from_millis(400));
    send(&run, Signal::SIGINT);
    let output = run.wait_with_output().unwrap();
    send(&emulator.child, Signal::SIGCONT);
    assert_eq!(output.status.signal(), Some(Signal::SIGINT as i32));
    let lines = ["stopping; Ctrl-C again", "ended at once: the board stops by itself"];
    let places = lines.map(|line| stderr(&output).find(line));
    assert!(places[0].is_some() && places[0] < places[1], "{}", stderr(&output));
}

/// The message at the signal cannot be written.
#[test]
fn a_stopped_terminal_delays_no_stop() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let mut emulator = Emulator::start();
    let mut states = States::of(&mut emulator.child);
    let terminal = openpty(None, None).unwrap();
    let run = ["run", "--rig", &rig, "--port", &emulator.port, "--law", "interval", "--out", "run"];
    let slave = terminal.slave.try_clone().unwrap();
    let mut run = program(&run, folder.path()).stderr(slave).spawn().unwrap();
    states.wait_for("seeking");
    // As Ctrl-S does.
    tcflow(&terminal.slave, FlowArg::TCOOFF).unwrap();
    send(&run, Signal::SIGINT);
    states.wait_for("ready");
    // Its result waits for the terminal, too.
    run.kill().unwrap();
    run.wait().unwrap();
}

/// `timeout` sends its signal to the program and to the program's group.
#[test]
fn two_signals_at_once_are_one_request() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    let run = ["run", "--rig", &rig, "--port", &emulator.port, "--json", "--out", "run"];
    let mut run =
        program(&run, folder.path()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    until_rows(&mut run, &folder.path().join("run"), 10);
    send(&run, Signal::SIGTERM);
    send(&run, Signal::SIGINT);
    assert_eq!(json(&run.wait_with_output().unwrap())["ending"], "interrupted");
}

#[test]
fn a_hangup_that_is_ignored_from_the_start_stays_ignored() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    let ignoring = r#"trap "" HUP; exec "$0" run --rig "$1" --port "$2" --json --out run"#;
    let mut run = Command::new("sh")
        .args(["-c", ignoring, env!("CARGO_BIN_EXE_plumb"), &rig, &emulator.port])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    until_rows(&mut run, &folder.path().join("run"), 10);
    send(&run, Signal::SIGHUP);
    until_rows(&mut run, &folder.path().join("run"), 30);
    send(&run, Signal::SIGTERM);
    let line = json(&run.wait_with_output().unwrap());
    assert!(line["ending"] == "interrupted" && line["frames"].as_u64().unwrap() >= 29, "{line}");
}

/// `plumb emulate --link board`, and the terminal's path that it prints.
fn emulate(folder: &Path) -> (Child, String) {
    let mut emulator = program(&["emulate", "--link", "board"], folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut port = String::new();
    BufReader::new(emulator.stdout.as_mut().unwrap()).read_line(&mut port).unwrap();
    (emulator, port.trim().to_owned())
}

#[test]
fn signals_end_an_emulation_and_its_link() {
    let folder = folder();
    let link = folder.path().join("board");
    for signal in [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP] {
        let (emulator, port) = emulate(folder.path());
        assert_eq!(fs::read_link(&link).unwrap(), Path::new(&port));
        send(&emulator, signal);
        assert_eq!(emulator.wait_with_output().unwrap().status.code(), Some(0), "{signal}");
        assert!(link.symlink_metadata().is_err(), "{signal}");
    }
}

#[test]
fn a_link_that_was_left_behind_is_replaced_and_nothing_else() {
    let folder = folder();
    let link = folder.path().join("board");
    let (mut killed, _) = emulate(folder.path());
    killed.kill().unwrap();
    killed.wait().unwrap();
    assert!(link.symlink_metadata().is_ok());
    // Another program may have got the number of its terminal by now.
    fs::remove_file(&link).unwrap();
    symlink("/dev/pts/1000001", &link).unwrap();
    let (emulator, port) = emulate(folder.path());
    assert_eq!(fs::read_link(&link).unwrap(), Path::new(&port));

    // The link of an emulation that goes on, and a link to something else.
    let second = plumb(&["emulate", "--link", "board"], folder.path());
    assert_eq!(second.status.code(), Some(2));
    assert!(stderr(&second).contains("board: exists already"), "{}", stderr(&second));
    send(&emulator, Signal::SIGTERM);
    emulator.wait_with_output().unwrap();
    symlink("absent", &link).unwrap();
    assert_eq!(plumb(&["emulate", "--link", "board"], folder.path()).status.code(), Some(2));
    assert_eq!(fs::read_link(&link).unwrap(), Path::new("absent"));
}
