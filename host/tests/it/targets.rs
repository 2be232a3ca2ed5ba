//! `plumb follow`: moving targets from other programs over an emulated board.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::common::{self, Emulator, folder, json, patient, plumb, rig_file, stderr, until_rows};

/// Boards have deadlines: one run at a time.
static TURN: Mutex<()> = Mutex::new(());

/// Starts `plumb follow` with these options besides those of every run.
fn start(folder: &Path, emulator: &Emulator, targets: &str) -> Child {
    let rig = rig_file(folder, patient);
    let run =
        ["follow", "--rig", &rig, "--law", "adaptive", "--port", &emulator.port, "--out", "run"];
    Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(run)
        .args(["--json", targets])
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Starts a run with the targets of its standard input. Returns it, once it has begun, and the
/// input: the run leaves out a target that waits for more than 0.5 s.
fn begun(folder: &Path, emulator: &Emulator) -> (Child, ChildStdin) {
    let mut run = start(folder, emulator, "-");
    let input = run.stdin.take().unwrap();
    until_rows(&mut run, &folder.join("run"), 2);
    (run, input)
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
    let emulator = Emulator::in_real_time(&[]);
    let (run, mut input) = begun(folder.path(), &emulator);
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
    assert_eq!(line["legs"][0]["target_m"].to_string(), "[0.4505,0.25,0.42]");
    let told = stderr(&output);
    assert!(told.contains("targets: line 42: no target: this is no object of JSON"), "{told}");
    assert!(told.contains("target [0.5000, 0.2500, 9.0000] m: that is outside the"), "{told}");
    assert!(told.contains(" refused, 1 unreadable"), "{told}");
    let (near, followed) = (&targets["near"], &targets["followed"]);
    let expected = format!("; the ball was at its target in {near} of {followed} pictures; since");
    assert!(told.contains(&expected), "{told}");
    assert!(folder.path().join("run/deviation.svg").exists());
}

/// As of a program that writes the times of JavaScript or of a camera's driver.
#[test]
fn times_in_milliseconds_end_the_run_with_the_reason() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let emulator = Emulator::in_real_time(&[]);
    let (run, mut input) = begun(folder.path(), &emulator);
    for k in 0..20 {
        let line = format!("{{\"t\": {}, \"target\": [0.5, 0.25, 0.42]}}\n", 5000 * k);
        // The run ends before the last line.
        let _ended = input.write_all(line.as_bytes());
        thread::sleep(Duration::from_millis(5));
    }
    let output = run.wait_with_output().unwrap();
    let (line, told) = (json(&output), stderr(&output));
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert_eq!((&line["reached"], &line["targets"]["late"]), (&false.into(), &10.into()));
    assert_eq!(line["ending"], "the lines of the targets could not be used", "{line}");
    assert!(told.contains("line 11: the time stamp has moved by +"), "{told}");
    assert!(told.contains("`t` is not in seconds") && !told.contains("since the frame"), "{told}");
}

/// As in `echo '{"target": ...}' | plumb follow -`.
#[test]
fn a_line_that_comes_before_the_run_begins_is_driven_to() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let emulator = Emulator::in_real_time(&[]);
    let mut run = start(folder.path(), &emulator, "-");
    let mut input = run.stdin.take().unwrap();
    input.write_all(b"{\"target\": [0.5, 0.25, 0.42]}\n").unwrap();
    drop(input);
    let (line, targets) = good(&run.wait_with_output().unwrap());
    assert_eq!((&targets["taken"], &targets["late"]), (&1.into(), &0.into()), "{line}");
    assert_eq!(line["legs"][0]["target_m"].to_string(), "[0.5,0.25,0.42]");
}

#[test]
fn a_file_is_played_and_a_wrong_one_is_refused_before_anything_moves() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let emulator = Emulator::in_real_time(&[]);
    let line = |t: f64, x: f64| format!("{{\"t\": {t}, \"target\": [{x}, 0.25, 0.42]}}\n");
    let lines: String = (0..60)
        .map(|k| (0.05 * f64::from(k), 0.5 - 0.001 * f64::from(k)))
        .map(|(t, x)| line(t, x))
        .collect();
    fs::write(folder.path().join("good.jsonl"), &lines).unwrap();
    fs::write(folder.path().join("bad.jsonl"), lines + "{}\n").unwrap();
    let output = start(folder.path(), &emulator, "good.jsonl").wait_with_output().unwrap();
    assert!(stderr(&output).contains("targets: good.jsonl, 60 in 3.0 s\n"), "{}", stderr(&output));
    let (line, _) = good(&output);
    assert_eq!(line["legs"][0]["target_m"].to_string(), "[0.441,0.25,0.42]");
    let rig = rig_file(folder.path(), patient);
    for (targets, named) in [
        (rig.as_str(), "rig.toml:"),
        ("bad.jsonl", "bad.jsonl:61: no target: missing field `target`"),
        ("none.jsonl", "'none.jsonl' is no shape; shapes are"),
        ("tcp:0.0.0.0:5601", "can be reached from other computers"),
    ] {
        let run = ["follow", "--rig", &rig, "--port", "/dev/null", "--out", "none", targets];
        let output = plumb(&run, folder.path());
        assert_eq!(output.status.code(), Some(2), "{targets}: {}", stderr(&output));
        assert!(stderr(&output).contains(named), "{targets}: {}", stderr(&output));
        assert!(!folder.path().join("none").exists(), "{targets}: nothing was run");
    }
}

/// Connects to a socket, as soon as the run listens there.
fn connect(run: &mut Child, path: &Path) -> UnixStream {
    loop {
        if let Ok(stream) = UnixStream::connect(path) {
            stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
            return stream;
        }
        assert!(run.try_wait().unwrap().is_none(), "the run has ended");
        thread::sleep(Duration::from_millis(10));
    }
}

/// Returns what a sender receives until its connection ends.
fn answer(mut sender: UnixStream) -> String {
    let mut bytes = Vec::new();
    // Bytes that were not read reset the connection after the answer.
    let _reset = sender.read_to_end(&mut bytes);
    String::from_utf8(bytes).unwrap()
}

#[test]
fn a_stranger_moves_nothing_and_a_sender_that_reconnects_is_welcome() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let emulator = Emulator::in_real_time(&[]);
    let mut run = start(folder.path(), &emulator, "unix:targets.sock");
    let socket = folder.path().join("targets.sock");
    let line = |x: f64| format!("{{\"target\": [{x}, 0.25, 0.42]}}\n");
    // What a form of a web page sends.
    let mut stranger = connect(&mut run, &socket);
    let mode = fs::symlink_metadata(&socket).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600, "{mode:o}");
    until_rows(&mut run, &folder.path().join("run"), 2);
    let post = "POST / HTTP/1.1\r\nHost: 127.0.0.1:5601\r\nContent-Type: text/plain\r\n\r\nx=\r\n";
    let _ended = stranger.write_all([post.to_owned(), line(0.46).repeat(9)].concat().as_bytes());
    stranger.shutdown(Shutdown::Write).unwrap();
    assert!(answer(stranger).contains("first line is no target"));
    // The connection of a sender is dead and open; the sender connects anew until it is taken.
    let mut dead = connect(&mut run, &socket);
    dead.write_all(line(0.49).as_bytes()).unwrap();
    dead.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
    let (mut sender, mut told) = (None, [0; 300]);
    while dead.read(&mut told).is_err() {
        drop(sender.take());
        let mut next = connect(&mut run, &socket);
        // One that is refused may have gone.
        let _refused = next.write_all(line(0.48).as_bytes());
        sender = Some(next);
    }
    let mut sender = sender.unwrap();
    assert!(String::from_utf8_lossy(&told).contains("nothing for 2 s"));
    for _ in 0..60 {
        sender.write_all(line(0.48).as_bytes()).unwrap();
        thread::sleep(Duration::from_millis(40));
    }
    common::send(&run, nix::sys::signal::Signal::SIGINT);
    let output = run.wait_with_output().unwrap();
    let (line, targets) = good(&output);
    assert_eq!(targets["unreadable"], 1, "{line}");
    assert_eq!(line["legs"][0]["target_m"].to_string(), "[0.48,0.25,0.42]");
    let told = stderr(&output);
    assert!(told.contains("its first line is no target (is it a browser or another"), "{told}");
    assert!(told.contains("it begins with \"POST / HTTP/1.1\""), "{told}");
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
    let emulator = Emulator::in_real_time(&[]);
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut run = start(folder.path(), &emulator, &format!("tcp:127.0.0.1:{port}"));
    // The script sends for 3 s: it begins after the first row.
    until_rows(&mut run, &folder.path().join("run"), 2);
    let status = Command::new("python3").args(["-c", &page_script(port)]).status();
    common::send(&run, nix::sys::signal::Signal::SIGINT);
    let output = run.wait_with_output().unwrap();
    match status {
        Ok(status) => assert!(status.success(), "{}", stderr(&output)),
        Err(error) => {
            assert!(std::env::var_os("CI").is_none(), "python3: {error}");
            println!("skipped: python3 cannot be started: {error}");
            return;
        }
    }
    let (line, targets) = good(&output);
    assert!(targets["taken"].as_u64().unwrap() > 20, "{line}");
    assert_eq!(line["ending"], "interrupted");
}
