//! Functions that the tests of the program share: start it and read its output.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Output, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use tempfile::TempDir;

pub(crate) fn plumb(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plumb")).args(arguments).current_dir(folder).output().unwrap()
}

/// Runs the program with bad input. Returns what it prints for people.
pub(crate) fn refusal(arguments: &[&str], folder: &Path) -> String {
    let output = plumb(arguments, folder);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
    stderr(&output)
}

/// The program, with every signal's usual effect: one that these tests are started with may be
/// ignored, as SIGHUP is behind `nohup`, and a program inherits that.
pub(crate) fn program(arguments: &[&str], folder: &Path) -> Command {
    let mut command = Command::new("env");
    command.args(["--default-signal", env!("CARGO_BIN_EXE_plumb")]);
    command.args(arguments).current_dir(folder).stdin(Stdio::null());
    command
}

/// Runs the program where no file may grow beyond `blocks` of 512 bytes. A write that would is an
/// error, as on a full disk. `redirection` is of the shell: "> rows.csv".
pub(crate) fn limited(arguments: &[&str], folder: &Path, blocks: u32, redirection: &str) -> Output {
    let line = format!(r#"ulimit -f {blocks}; exec "$0" "$@" {redirection}"#);
    Command::new("sh")
        .args(["-c", &line, env!("CARGO_BIN_EXE_plumb")])
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Sends `signal` to `child`.
pub(crate) fn send(child: &Child, signal: Signal) {
    kill(Pid::from_raw(i32::try_from(child.id()).unwrap()), signal).unwrap();
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The last line of standard output, which is JSON.
pub(crate) fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(text.lines().last().unwrap_or_default())
        .unwrap_or_else(|e| panic!("{e}: {text}"))
}

pub(crate) fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// The examples of the repository.
pub(crate) fn rigs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs")
}

/// The paper's rig file, changed by `edit`, beside its camera file.
pub(crate) fn rig_file(folder: &Path, edit: impl Fn(String) -> String) -> String {
    fs::copy(rigs().join("camera.toml"), folder.join("camera.toml")).unwrap();
    let path = folder.join("rig.toml");
    fs::write(&path, edit(fs::read_to_string(rigs().join("paper.toml")).unwrap())).unwrap();
    path.to_str().unwrap().to_owned()
}

/// A rig file's text with deadlines that a busy machine keeps.
pub(crate) fn patient(text: String) -> String {
    let text = text.replace("host = 0.3", "host = 5.0").replace("position = 0.5", "position = 5.0");
    text.replace("max_age = 0.25", "max_age = 4.9")
}

/// Lines of a rig file whose simulated camera stands 50 m beside the rig and never sees the ball.
pub(crate) const CAMERA_AWAY: &str = "
[simulation.camera]
translation = [1.737, 50.0, 0.225]
quaternion = [-0.5, -0.5, 0.5, 0.5]
";

/// `plumb emulate` in the background; killed when dropped.
pub(crate) struct Emulator {
    pub(crate) child: Child,
    pub(crate) port: String,
}

impl Emulator {
    pub(crate) fn start() -> Self {
        Self::start_with(&[])
    }

    /// The same at the pace of the world, for a test whose own time matters.
    pub(crate) fn in_real_time(options: &[&str]) -> Self {
        Self::at_pace("1", options)
    }

    /// The same with options.
    pub(crate) fn start_with(options: &[&str]) -> Self {
        Self::at_pace("20", options)
    }

    fn at_pace(pace: &str, options: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_plumb"))
            .args(["emulate", "--json", "-v", "--pace", pace])
            .args(options)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut port = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut port).unwrap();
        Self { child, port: port.trim().to_owned() }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns the address of a page, with its port, from the messages of a program.
pub(crate) fn page_address(lines: &mut impl Iterator<Item = String>) -> String {
    let line = lines.find(|line| line.starts_with("page: ")).unwrap();
    line.split("http://").nth(1).unwrap().split('/').next().unwrap().to_owned()
}

/// States of the board, as the emulator prints them.
pub(crate) struct States(BufReader<ChildStderr>);

impl States {
    pub(crate) fn of(emulator: &mut Child) -> Self {
        Self(BufReader::new(emulator.stderr.take().unwrap()))
    }

    /// Waits for a state with this text. No command is sent meanwhile, which would end the host's
    /// silence.
    pub(crate) fn wait_for(&mut self, text: &str) -> String {
        let mut state = String::new();
        while !state.contains(text) {
            state.clear();
            assert!(self.0.read_line(&mut state).unwrap() > 0, "the emulator has ended");
        }
        state
    }
}

/// Waits until the run in `folder` has so many rows; or until it has ended, which the test will
/// see.
pub(crate) fn until_rows(run: &mut Child, folder: &Path, count: usize) {
    let rows = || fs::read_to_string(folder.join("run.csv")).unwrap_or_default().lines().count();
    while rows() < count && run.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
}

/// Records the paper's ball at rest for half a second to `folder/recording`.
pub(crate) fn record(folder: &Path) -> PathBuf {
    let demo = [
        "demo",
        "--virtual-time",
        "--timeout",
        "0.5",
        "--record",
        "recording",
        "--out",
        "recorded-run",
    ];
    let output = plumb(&demo, folder);
    assert!(stderr(&output).contains("recorded: "), "{}", stderr(&output));
    folder.join("recording")
}
