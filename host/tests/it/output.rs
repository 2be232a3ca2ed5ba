//! Output that nobody reads: how the program ends.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, ErrorKind, PipeReader, PipeWriter, Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{ExitStatus, Stdio};
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::pty::{OpenptyResult, Winsize, openpty};
use nix::sys::signal::Signal;
use nix::sys::termios::{FlowArg, tcflow};

use crate::common::{Emulator, folder, program, record, send, stderr};

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
    assert!(line.starts_with("time_s,u_px,v_px,radius_px,depth_m,"), "{line}");
    let output = replay.wait_with_output().unwrap();
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
}

#[test]
fn closed_pipes_change_no_exit_code() {
    let folder = folder();
    let emulator = Emulator::start();
    let cases: [(&[&str], i32); 3] = [
        (&SHORT_DEMO, 1),
        (&["board", "status", "--json", "--port", &emulator.port], 0),
        (&["run", "--rig", "absent.toml"], 2),
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
    for arguments in [&["replay", "recording"] as &[&str], &SHORT_DEMO, &["emulate"]] {
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
    let folder = folder();
    let mut demo =
        program(&SHORT_DEMO, folder.path()).stdout(writer).stderr(no_room).spawn().unwrap();
    let mut text = String::new();
    reader.read_to_string(&mut text).unwrap();
    assert_eq!(demo.wait().unwrap().code(), Some(1));
    let line: serde_json::Value = serde_json::from_str(text.trim_start()).unwrap();
    assert!(line.is_object(), "{line}");
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

#[test]
fn a_terminal_that_nobody_reads_does_not_keep_the_program() {
    let folder = folder();
    let terminal = openpty(None, None).unwrap();
    tcflow(&terminal.slave, FlowArg::TCOOFF).unwrap();
    let demo = |out: &str, options: &[&str]| {
        let demo = [&["demo", "--virtual-time", "--out", out][..], options].concat();
        program(&demo, folder.path())
            .stdout(Stdio::piped())
            .stderr(terminal.slave.try_clone().unwrap())
            .spawn()
            .unwrap()
    };
    // Both wait at once.
    let ends = [demo("run", &[]), demo("short", &["--timeout", "0.5"])]
        .map(|demo| demo.wait_with_output().unwrap());
    assert_eq!(ends.map(|output| output.status.code()), [Some(0), Some(1)]);
}

/// A progress line that is longer than the terminal's would leave a line behind at each renewal.
#[test]
fn progress_keeps_to_one_line_of_a_narrow_terminal() {
    let folder = folder();
    record(folder.path());
    let (columns, clear) = (24, "\r\u{1b}[2K");
    for arguments in [&SHORT_DEMO[..], &["replay", "recording"]] {
        let size = Winsize { ws_row: 10, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
        let OpenptyResult { master, slave } = openpty(&size, None).unwrap();
        let mut command = program(arguments, folder.path());
        let mut run = command.stdout(Stdio::null()).stderr(slave).spawn().unwrap();
        // It has the terminal open.
        drop(command);
        let mut shown = Vec::new();
        // The end of a terminal is an error.
        let _end = File::from(master).read_to_end(&mut shown);
        run.wait().unwrap();
        let shown = String::from_utf8(shown).unwrap();
        let lines = shown.split(clear).skip(1).filter(|line| !line.contains('\n'));
        let longest = lines.map(|line| line.chars().count()).max();
        let is_one_line = longest.is_some_and(|longest| (1..columns.into()).contains(&longest));
        assert!(is_one_line, "{arguments:?}: {longest:?} in {shown:?}");
    }
}
