//! Output that nobody reads, and signals: how the program ends.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod common;

use std::fs::{self, File, OpenOptions};
use std::io::{BufRead, BufReader, ErrorKind, PipeReader, PipeWriter, Read, Write};
use std::os::unix::fs::symlink;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::pty::openpty;
use nix::sys::signal::{Signal, kill};
use nix::sys::termios::{FlowArg, tcflow};
use nix::unistd::Pid;

use common::{Emulator, folder, json, patient, plumb, record, rig_file, stderr, until_rows};

/// The program, with every signal's usual effect: one that these tests are started with may be
/// ignored, as SIGHUP is behind `nohup`, and a program inherits that.
fn program(arguments: &[&str], folder: &Path) -> Command {
    let mut command = Command::new("env");
    command.args(["--default-signal", env!("CARGO_BIN_EXE_plumb")]);
    command.args(arguments).current_dir(folder).stdin(Stdio::null());
    command
}

/// A pipe whose reader has gone.
fn closed() -> PipeWriter {
    std::io::pipe().unwrap().1
}

fn full_disk() -> File {
    OpenOptions::new().write(true).open("/dev/full").unwrap()
}

/// A pipe without room whose writer does not wait.
fn full_pipe() -> (PipeReader, PipeWriter) {
    let (reader, mut writer) = std::io::pipe().unwrap();
    fcntl(&writer, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).unwrap();
    while writer.write(b"\n").map_err(|error| error.kind()) != Err(ErrorKind::WouldBlock) {}
    (reader, writer)
}

fn send(child: &Child, signal: Signal) {
    kill(Pid::from_raw(i32::try_from(child.id()).unwrap()), signal).unwrap();
}

const PAPER: [&str; 5] = ["bench", "control", "--suite", "paper", "--json"];
const SHORT_DEMO: [&str; 4] = ["demo", "--virtual-time", "--timeout", "0.5"];

#[test]
fn rows_that_nobody_reads_any_more_end_a_replay_quietly() {
    let folder = folder();
    record(folder.path());
    let mut replay = program(&["replay", "recording"], folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // As `head -1` does.
    let mut line = String::new();
    BufReader::new(replay.stdout.take().unwrap()).read_line(&mut line).unwrap();
    assert_eq!(line, "t,u,v,radius,depth,x,y,z,score\n");
    let output = replay.wait_with_output().unwrap();
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
}

#[test]
fn closed_pipes_change_no_exit_code() {
    let folder = folder();
    let rig = rig_file(folder.path(), |text| text);
    let emulator = Emulator::start();
    let cases: [(&[&str], i32); 5] = [
        (&PAPER, 0),
        (&SHORT_DEMO, 1),
        (&["board", "status", "--json", "--port", &emulator.port], 0),
        (&["run", "absent.toml"], 2),
        (&["verify", &rig, "--cells", "1", "--json"], 1),
    ];
    for (arguments, code) in cases {
        let status: ExitStatus =
            program(arguments, folder.path()).stdout(closed()).stderr(closed()).status().unwrap();
        assert_eq!(status.code(), Some(code), "{arguments:?}");
        let status = program(arguments, folder.path())
            .stdout(Stdio::null())
            .stderr(full_disk())
            .status()
            .unwrap();
        assert_eq!(status.code(), Some(code), "{arguments:?}");
    }
}

#[test]
fn an_engine_that_goes_ends_a_cosimulation() {
    let mut cosim = program(&["cosim"], Path::new("."))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut requests = cosim.stdin.take().unwrap();
    drop(cosim.stdout.take());
    writeln!(requests, r#"{{"t": 0.0, "dt": 0.1}}"#).unwrap();
    // Its standard input is still open.
    assert_eq!(cosim.wait().unwrap().code(), Some(0));
}

#[test]
fn results_that_cannot_be_written_are_an_error() {
    let folder = folder();
    record(folder.path());
    for arguments in [&PAPER as &[&str], &["replay", "recording"], &SHORT_DEMO, &["emulate"]] {
        let output = program(arguments, folder.path())
            .stdout(full_disk())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let output = output.wait_with_output().unwrap();
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {text}");
        assert!(
            text.contains("cannot be written") && text.contains("No space left"),
            "{arguments:?}: {text}"
        );
    }
}

#[test]
fn a_full_pipe_that_does_not_wait_is_waited_for() {
    let (mut reader, writer) = full_pipe();
    let (_, no_room) = full_pipe();
    let mut bench = program(&PAPER, Path::new(".")).stdout(writer).stderr(no_room).spawn().unwrap();
    let mut text = String::new();
    reader.read_to_string(&mut text).unwrap();
    assert_eq!(bench.wait().unwrap().code(), Some(0));
    let line: serde_json::Value = serde_json::from_str(text.trim_start()).unwrap();
    assert_eq!(line["suite"], "paper");
}

#[test]
fn signals_end_a_run_with_its_summary() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    for signal in [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP] {
        let emulator = Emulator::start();
        let name = signal.as_str();
        for (out, start) in [
            (format!("run-{name}"), vec!["run", &rig, "--port", &emulator.port, "--json"]),
            (format!("demo-{name}"), vec!["demo", "--law", "interval"]),
        ] {
            let arguments = [&start[..], &["--out", &out]].concat();
            let mut run = program(&arguments, folder.path())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            until_rows(&mut run, &folder.path().join(&out), 10);
            send(&run, signal);
            let output = run.wait_with_output().unwrap();
            assert_eq!(output.status.code(), Some(1), "{out}: {}", stderr(&output));
            assert_eq!(json(&output)["ending"], "interrupted", "{out}");
            let summary =
                fs::read_to_string(folder.path().join(&out).join("summary.json")).unwrap();
            assert!(summary.contains("interrupted"), "{summary}");
        }
    }
}

/// The board's process is stopped, so that the run waits for it after the first signal.
#[test]
fn a_second_signal_ends_a_run_at_once() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    let mut run = program(&["run", &rig, "--port", &emulator.port, "--out", "run"], folder.path())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    until_rows(&mut run, &folder.path().join("run"), 10);
    send(&emulator.child, Signal::SIGSTOP);
    send(&run, Signal::SIGTERM);
    thread::sleep(Duration::from_millis(400));
    send(&run, Signal::SIGINT);
    assert_eq!(run.wait().unwrap().signal(), Some(Signal::SIGINT as i32));
    send(&emulator.child, Signal::SIGCONT);
}

/// `timeout` sends its signal to the program and to the program's group.
#[test]
fn two_signals_at_once_are_one_request() {
    let folder = folder();
    let rig = rig_file(folder.path(), patient);
    let emulator = Emulator::start();
    let run = ["run", &rig, "--port", &emulator.port, "--json", "--out", "run"];
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
    let ignoring = r#"trap "" HUP; exec "$0" run "$1" --port "$2" --json --out run"#;
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

#[test]
fn a_stopped_terminal_holds_back_no_result_and_no_signal() {
    let folder = folder();
    let terminal = openpty(None, None).unwrap();
    // As Ctrl-S does.
    tcflow(&terminal.slave, FlowArg::TCOOFF).unwrap();
    let mut demo = program(&["demo", "--virtual-time", "--out", "run"], folder.path())
        .stdout(Stdio::piped())
        .stderr(terminal.slave.try_clone().unwrap())
        .spawn()
        .unwrap();
    let stdout = demo.stdout.take().unwrap();
    let (sender, lines) = channel();
    thread::spawn(move || sender.send(BufReader::new(stdout).lines().next()));
    let line = lines.recv_timeout(Duration::from_secs(60));
    send(&demo, Signal::SIGTERM);
    let ended = (0..100).find_map(|_| {
        thread::sleep(Duration::from_millis(50));
        demo.try_wait().unwrap()
    });
    if ended.is_none() {
        demo.kill().unwrap();
    }
    assert!(line.unwrap().unwrap().unwrap().contains("\"reached\":true"));
    assert_eq!(ended.unwrap().signal(), Some(Signal::SIGTERM as i32));
    assert!(folder.path().join("run/figure5.svg").exists());
}
