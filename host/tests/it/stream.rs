//! Programs in Python as cameras: the ten lines of the book, and a rig that a script shows.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use nix::sys::signal::Signal;

use crate::common::{self, Emulator, folder, json, patient, plumb, rig_file, stderr};

/// Boards have deadlines: one run at a time.
static TURN: Mutex<()> = Mutex::new(());

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Script in the background; killed when dropped.
struct Script(Child);

impl Script {
    /// Starts Python with these arguments. Returns `None` where there is no Python; with CI set,
    /// that fails the test.
    fn start(folder: &Path, arguments: &[&str]) -> Option<Self> {
        let mut command = Command::new("python3");
        command.args(arguments).current_dir(folder).stdout(Stdio::null()).stderr(Stdio::null());
        match command.spawn() {
            Ok(child) => Some(Self(child)),
            Err(error) => {
                assert!(std::env::var_os("CI").is_none(), "python3: {error}");
                println!("skipped: python3 cannot be started: {error}");
                None
            }
        }
    }
}

impl Drop for Script {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Writes the paper's rig file for a board on `port` and the stream at `address`.
fn stream_rig(folder: &Path, port: &str, address: &str) {
    rig_file(folder, |text| {
        let text = text[..text.find("\n[simulation]").unwrap()].replace("/dev/ttyACM0", port);
        let camera = format!("file = \"camera.toml\"\nsource = \"stream\"\nstream = \"{address}\"");
        patient(text.replace("file = \"camera.toml\"", &camera))
    });
}

/// Returns the only block of Python on the page.
fn page_script() -> String {
    let page = std::fs::read_to_string(repository().join("docs/use/stream.md")).unwrap();
    let mut blocks = page.split("```python\n").skip(1);
    let block = blocks.next().unwrap().split("```").next().unwrap().to_owned();
    assert!(blocks.next().is_none(), "the page has a second script");
    assert_eq!(block.lines().count(), 10, "the page promises ten lines");
    block
}

/// Returns the block with a loop that waits for Plumb instead of a connection that fails.
fn patient_script(port: u16) -> String {
    let begin = "import time, socket\n\
                 def listening():\n\
                 \x20   try: return socket.create_connection((\"127.0.0.1\", PORT))\n\
                 \x20   except ConnectionRefusedError: time.sleep(0.02)\n";
    let connect = "socket.create_connection((\"127.0.0.1\", 5600))";
    let script = page_script();
    assert!(script.contains(connect), "{script}");
    let wait = "next(filter(None, iter(listening, 0)))";
    format!("{begin}{}", script.replace(connect, wait)).replace("PORT", &port.to_string())
}

#[test]
fn ten_lines_of_the_book_are_a_camera() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let Some(_script) = Script::start(folder.path(), &["-c", &patient_script(port)]) else {
        return;
    };
    let emulator = Emulator::start();
    stream_rig(folder.path(), &emulator.port, &format!("tcp:127.0.0.1:{port}"));
    let output = plumb(&["run", "--out", "run", "--json"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("640x480, colour rgb8, depth z16"), "{}", stderr(&output));
    let summary = json(&output);
    assert_eq!(summary["lost"], 0, "{summary}");
    // The ball of the picture hangs still, within a pixel of the target.
    assert!(summary["filtered_error_mm"].as_f64().unwrap() < 4.0, "{summary}");
}

/// What a form of a web page sends.
const STRANGER: &[u8] = b"POST /upload HTTP/1.1\r\nContent-Type: text/plain\r\n\r\n{\"t\": 0}\n";

#[test]
fn a_stranger_before_the_camera_is_ended_and_the_camera_is_awaited() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let emulator = Emulator::start();
    stream_rig(folder.path(), &emulator.port, &format!("tcp:127.0.0.1:{port}"));
    let mut run = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(["run", "--out", "run", "--json"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stranger = loop {
        if let Ok(stream) = TcpStream::connect(("127.0.0.1", port)) {
            break stream;
        }
        assert!(run.try_wait().unwrap().is_none(), "the run has ended");
        std::thread::sleep(Duration::from_millis(5));
    };
    stranger.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    stranger.write_all(STRANGER).unwrap();
    let mut answer = Vec::new();
    // Bytes that were not read reset the connection after the answer.
    let _reset = stranger.read_to_end(&mut answer);
    let answer = String::from_utf8(answer).unwrap();
    assert!(answer.contains("its first line is no header of a frame"), "{answer}");
    assert!(answer.contains("POST /upload HTTP/1.1"), "{answer}");
    let script = Script::start(folder.path(), &["-c", &patient_script(port)]);
    if script.is_none() {
        common::send(&run, Signal::SIGINT);
    }
    let output = run.wait_with_output().unwrap();
    assert!(script.is_none() || output.status.success(), "{}", stderr(&output));
}

/// The whole loop: the board's motors move the ball that the script shows.
#[test]
fn the_papers_task_is_done_with_a_script_as_the_camera() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let script = repository().join("host/examples/stream_rig.py");
    let arguments = [script.to_str().unwrap(), "--plumb", env!("CARGO_BIN_EXE_plumb")];
    let Some(mut script) = Script::start(folder.path(), &arguments) else { return };
    while !folder.path().join("board").exists() {
        assert!(script.0.try_wait().unwrap().is_none(), "the script has ended");
        std::thread::sleep(Duration::from_millis(20));
    }
    stream_rig(folder.path(), "board", "unix:camera.sock");
    let output = plumb(&["run", "--out", "run", "--json"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let summary = json(&output);
    assert!(summary["filtered_error_mm"].as_f64().unwrap() < 10.0, "{summary}");
    // The ball begins 38 cm from the target and moves through many pictures.
    let log = std::fs::read_to_string(folder.path().join("run/run.csv")).unwrap();
    let heights: Vec<f64> =
        log.lines().skip(1).filter_map(|row| row.split(',').nth(8)?.parse().ok()).collect();
    assert!(heights.first().unwrap() > &0.44 && heights.last().unwrap() < &0.16, "{heights:?}");
}

/// Runs with standard input as the camera, which sends `bytes` and ends. Returns the output.
fn run_with_input(bytes: &[u8]) -> Output {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let emulator = Emulator::start();
    stream_rig(folder.path(), &emulator.port, "-");
    let mut run = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(["run", "--out", "run", "--json"])
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A run that refuses the frames closes the pipe.
    let _ = run.stdin.take().unwrap().write_all(bytes);
    run.wait_with_output().unwrap()
}

#[test]
fn standard_input_is_a_camera_until_it_ends() {
    let mut bytes = Vec::new();
    for number in 0..5 {
        let header = format!(
            r#"{{"t": {}, "width": 640, "height": 480, "colour": "bgr8", "colour_bytes": 921600}}"#,
            f64::from(number) * 0.001
        );
        bytes.extend(format!("{header}\n").bytes());
        bytes.extend(vec![100; 921_600]);
    }
    let output = run_with_input(&bytes);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let summary = json(&output);
    assert_eq!(summary["ending"], "no more pictures", "{summary}");
    assert_eq!(summary["located"], 0, "{summary}");
    // The end within a frame has a reason.
    let torn = run_with_input(&bytes[..bytes.len() - 1]);
    assert_eq!(torn.status.code(), Some(1), "{}", stderr(&torn));
    assert!(stderr(&torn).contains("ended in the middle of frame 5"), "{}", stderr(&torn));
    // So has an input that is no stream: nothing moves.
    for (bytes, reason) in [
        (&b""[..], "ended before the first frame"),
        (b"JFIF\n", "the header of frame 1 is refused: the line with the header is not as"),
    ] {
        let output = run_with_input(bytes);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(reason), "{}", stderr(&output));
    }
}

#[test]
fn a_signal_ends_the_wait_for_the_first_frame() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let emulator = Emulator::start();
    stream_rig(folder.path(), &emulator.port, "unix:camera.sock");
    let mut run = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(["run", "--out", "run"])
        .current_dir(folder.path())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !folder.path().join("camera.sock").exists() {
        assert!(run.try_wait().unwrap().is_none(), "the run has ended");
        std::thread::sleep(Duration::from_millis(5));
    }
    common::send(&run, Signal::SIGINT);
    let output = run.wait_with_output().unwrap();
    // A run that waits to the end has an exit code and an error.
    assert_eq!(output.status.signal(), Some(Signal::SIGINT as i32), "{}", stderr(&output));
    assert!(!folder.path().join("run").exists());
}

#[test]
fn a_calibration_refuses_a_camera_on_its_standard_input() {
    let folder = folder();
    stream_rig(folder.path(), "/dev/null", "-");
    let output = plumb(&["calibrate", "--ball"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("reads answers"), "{}", stderr(&output));
}

#[test]
fn addresses_are_checked_before_anything_moves() {
    let folder = folder();
    for (address, reason) in [
        ("tcp:0.0.0.0:5600", "can be reached from other computers"),
        ("tcp:127.0.0.1:0", "has no port"),
        ("camera.sock", "is no address of a stream"),
    ] {
        stream_rig(folder.path(), "/dev/null", address);
        let output = plumb(&["check", "--file-only"], folder.path());
        assert_eq!(output.status.code(), Some(2), "{address}: {}", stderr(&output));
        assert!(stderr(&output).contains(reason), "{address}: {}", stderr(&output));
    }
}
