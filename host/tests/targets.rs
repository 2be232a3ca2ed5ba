//! `plumb run --targets`: moving targets from other programs over an emulated board.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod common;

use std::fs;
use std::io::Write;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

use common::{Emulator, folder, json, patient, plumb, rig_file, stderr, until_rows};

/// Boards have deadlines: one run at a time.
static TURN: Mutex<()> = Mutex::new(());

/// Starts `plumb run` with these options besides those of every run.
fn start(folder: &Path, emulator: &Emulator, targets: &str) -> Child {
    let rig = rig_file(folder, patient);
    let run = ["run", &rig, "--law", "adaptive", "--port", &emulator.port, "--out", "run"];
    Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(run)
        .args(["--json", "--targets", targets])
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Returns the result of a run that ended well, and its key `targets`.
fn good(output: &Output) -> (Value, Value) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    let line = json(output);
    assert_eq!(line["reached"], true, "{line}");
    (line.clone(), line["targets"].clone())
}

#[test]
fn lines_of_standard_input_move_the_ball_and_bad_ones_are_told() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let emulator = Emulator::start();
    let mut run = start(folder.path(), &emulator, "-");
    let mut input = run.stdin.take().unwrap();
    // The run leaves out a target that waits for more than 0.5 s: they begin after its first row.
    until_rows(&mut run, &folder.path().join("run"), 2);
    // The target stays at its last place: a busy machine may take one or another too late.
    let place = |k: u32| [0.5 - 0.0005 * f64::from(k.min(99)), 0.25, 0.42];
    let begin = Instant::now();
    for k in 0..125 {
        let t = begin.elapsed().as_secs_f64();
        writeln!(input, "{{\"t\": {t}, \"target\": {:?}}}", place(k)).unwrap();
        if k == 40 {
            input.write_all(b"hello\n").unwrap();
        }
        // Nine targets outside the workspace, since some of them may be taken too late.
        if k >= 40 && k % 10 == 0 {
            input.write_all(b"{\"target\": [0.5, 0.25, 9]}\n").unwrap();
        }
        thread::sleep(Duration::from_millis(40));
    }
    drop(input);
    let output = run.wait_with_output().unwrap();
    let (line, targets) = good(&output);
    assert_eq!(targets["unreadable"], 1, "{line}");
    assert!((1..=9).contains(&targets["refused"].as_u64().unwrap()), "{line}");
    assert!(targets["taken"].as_u64().unwrap() > 10, "{line}");
    assert!(targets["frames"].as_u64().unwrap() > 0, "{line}");
    assert!(targets["error"]["rms_mm"].as_f64().unwrap() > 0.0, "{line}");
    assert_eq!(line["legs"][0]["target"].to_string(), "[0.4505,0.25,0.42]");
    let told = stderr(&output);
    assert!(told.contains("targets: line 42: no target: expected value"), "{told}");
    assert!(told.contains("target [0.5000, 0.2500, 9.0000] m: that is outside the"), "{told}");
    assert!(told.contains(" refused, 1 unreadable") && told.contains("distance from"), "{told}");
    assert!(folder.path().join("run/deviation.svg").exists());
}

#[test]
fn a_file_is_played_and_a_wrong_one_is_refused_before_anything_moves() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let emulator = Emulator::start();
    let line = |t: f64, x: f64| format!("{{\"t\": {t}, \"target\": [{x}, 0.25, 0.42]}}\n");
    let lines: String = (0..60)
        .map(|k| (0.05 * f64::from(k), 0.5 - 0.001 * f64::from(k)))
        .map(|(t, x)| line(t, x))
        .collect();
    fs::write(folder.path().join("good.jsonl"), &lines).unwrap();
    fs::write(folder.path().join("bad.jsonl"), lines + "{}\n").unwrap();
    let output = start(folder.path(), &emulator, "good.jsonl").wait_with_output().unwrap();
    let (line, _) = good(&output);
    assert_eq!(line["legs"][0]["target"].to_string(), "[0.441,0.25,0.42]");
    let rig = rig_file(folder.path(), patient);
    for (targets, named) in [
        ("bad.jsonl", "bad.jsonl: line 61: no target: missing field `target`"),
        ("none.jsonl", "there is no file \"none.jsonl\""),
        ("tcp:0.0.0.0:5601", "can be reached from other computers"),
    ] {
        let run = ["run", &rig, "--port", "/dev/null", "--out", "none", "--targets", targets];
        let output = plumb(&run, folder.path());
        assert_eq!(output.status.code(), Some(2), "{targets}: {}", stderr(&output));
        assert!(stderr(&output).contains(named), "{targets}: {}", stderr(&output));
        assert!(!folder.path().join("none").exists(), "{targets}: nothing was run");
    }
}

/// Returns the block of Python on the page, for this port and 3 s.
fn page_script(port: u16) -> String {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/use/moving-targets.md");
    let page = fs::read_to_string(page).unwrap();
    let script = page.split("```python\n").nth(1).unwrap().split("```").next().unwrap();
    assert!(script.contains("5601") && script.contains("begin + 20"), "{script}");
    script.replace("5601", &port.to_string()).replace("begin + 20", "begin + 3")
}

#[test]
fn the_program_of_the_book_moves_the_ball() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let emulator = Emulator::start();
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let run = start(folder.path(), &emulator, &format!("tcp:127.0.0.1:{port}"));
    let status = loop {
        let mut script = Command::new("python3");
        let status = script.args(["-c", &page_script(port)]).stderr(Stdio::null()).status();
        match status {
            // Plumb does not listen so far.
            Ok(status) if !status.success() => thread::sleep(Duration::from_millis(50)),
            status => break status,
        }
    };
    common::send(&run, nix::sys::signal::Signal::SIGINT);
    let output = run.wait_with_output().unwrap();
    if let Err(error) = status {
        assert!(std::env::var_os("CI").is_none(), "python3: {error}");
        println!("skipped: python3 cannot be started: {error}");
        return;
    }
    let (line, targets) = good(&output);
    assert!(targets["taken"].as_u64().unwrap() > 20, "{line}");
    assert_eq!(line["ending"], "interrupted");
}
