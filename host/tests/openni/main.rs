//! The program with a camera, through the real libOpenNI2 and the test driver of
//! `tests/openni-driver`.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use plumb_openni_driver::{CONTROL_VARIABLE, Control, ControlFile, FOCAL_LENGTH};
use tempfile::TempDir;

/// Folder with the library, a camera and a rig file.
struct Fixture {
    folder: TempDir,
    library: PathBuf,
    camera: ControlFile,
}

/// Target of the rig file in the axes of the camera of `rigs/camera.toml`, metres: PT, 1.337 m in
/// front of it.
const AT_TARGET: [f64; 3] = [0.400 - 0.286, -(0.150 - 0.225), 1.737 - 0.400];

impl Fixture {
    /// Prepares the folder, with the test driver where `driver` is set. Returns `None` where the
    /// library is not installed; with CI set, that fails the test.
    fn new(driver: bool) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let library = match plumb_openni_driver::stage(&folder.path().join("openni"), driver) {
            Ok(library) => library,
            Err(error) => {
                assert!(std::env::var_os("CI").is_none(), "{error}");
                println!("skipped: {error}");
                return None;
            }
        };
        let camera = ControlFile::create(&folder.path().join("control"), &Self::control()).unwrap();
        Some(Self { folder, library, camera })
    }

    /// Returns a control file's contents with the ball at the target.
    fn control() -> Control {
        Control { ball: Some(AT_TARGET), ..Control::default() }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Returns a command of the program that uses the folder's library and camera.
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command
            .args(arguments)
            .current_dir(self.path())
            .env(plumb_cameras::source::openni::LIBRARY_VARIABLE, &self.library)
            .env(CONTROL_VARIABLE, self.camera.path());
        command
    }

    /// Runs the program to its end.
    fn plumb(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// Runs and records. Returns the path of the `.oni` file and its bytes.
    fn record(&self) -> (PathBuf, Vec<u8>) {
        let run = self.plumb(&["run", "rig.toml", "--record", "recording", "--out", "run"]);
        assert!(run.status.success(), "{}", stderr(&run));
        let path = self.path().join("recording/recording.oni");
        let whole = fs::read(&path).unwrap();
        (path, whole)
    }

    /// Writes the paper's rig file for a board on `port`, without its simulated rig and with the
    /// lines `camera` in its table `[camera]`.
    fn rig(&self, port: &str, camera: &str) {
        let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
        let text = fs::read_to_string(rigs.join("paper.toml")).unwrap();
        let text = text[..text.find("\n[simulation]").unwrap()].replace("/dev/ttyACM0", port);
        let text =
            text.replace("file = \"camera.toml\"", &format!("file = \"camera.toml\"\n{camera}"));
        // Longer deadlines, so that a busy machine does not stop the run.
        let text =
            text.replace("host = 0.3", "host = 5.0").replace("position = 0.5", "position = 5.0");
        let text = text.replace("max_age = 0.25", "max_age = 4.9");
        fs::write(self.path().join("rig.toml"), text).unwrap();
        fs::copy(rigs.join("camera.toml"), self.path().join("camera.toml")).unwrap();
    }
}

/// `plumb emulate` in the background, one at a time, because boards have deadlines. Dropping it
/// ends the process.
struct Emulator {
    child: Child,
    port: String,
    _turn: MutexGuard<'static, ()>,
}

static TURN: Mutex<()> = Mutex::new(());

impl Emulator {
    fn start() -> Self {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let mut child = Command::new(env!("CARGO_BIN_EXE_plumb"))
            .arg("emulate")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut port = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut port).unwrap();
        Self { child, port: port.trim().to_owned(), _turn: turn }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Waits until the run log has `count` rows or the run has ended.
fn until_rows(run: &mut Child, folder: &Path, count: usize) {
    let rows =
        || fs::read_to_string(folder.join("run/run.csv")).unwrap_or_default().lines().count();
    while rows() < count && run.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Returns the fields of a CSV's rows, without its header.
fn rows(text: &str) -> Vec<Vec<String>> {
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn a_missing_library_is_reported_with_its_package() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.oni"), b"NI10").unwrap();
    let camera = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/camera.toml");
    let camera = camera.to_str().unwrap();
    for arguments in [&["cameras", "--json"][..], &["replay", "a.oni", "--camera", camera]] {
        let output = Command::new(env!("CARGO_BIN_EXE_plumb"))
            .args(arguments)
            .current_dir(folder.path())
            .env(plumb_cameras::source::openni::LIBRARY_VARIABLE, "/no/such/libOpenNI2.so.0")
            .output()
            .unwrap();
        let text = stderr(&output);
        assert!(matches!(output.status.code(), Some(1 | 2)), "{text}");
        assert!(text.contains("libopenni2-0") && text.contains("/no/such"), "{text}");
    }
    // Another library under that path.
    let other = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .arg("cameras")
        .env(plumb_cameras::source::openni::LIBRARY_VARIABLE, "libc.so.6")
        .output()
        .unwrap();
    assert!(stderr(&other).contains("not OpenNI 2.2"), "{}", stderr(&other));
}

#[test]
fn cameras_lists_library_drivers_and_cameras() {
    let Some(fixture) = Fixture::new(true) else { return };
    let output = fixture.plumb(&["cameras", "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(json["cameras"][0]["uri"], fixture.camera.uri());
    assert_eq!(json["cameras"][0]["name"], "Plumb test camera");
    let drivers = &json["openni"]["loaded"]["drivers"];
    assert_eq!(drivers, &serde_json::json!(["libOniFile.so.0", "libPlumbTest.so.0"]));
}

#[test]
fn a_missing_camera_is_reported() {
    let Some(fixture) = Fixture::new(false) else { return };
    let output = fixture.plumb(&["cameras"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("missing: "), "{}", stderr(&output));
    let emulator = Emulator::start();
    fixture.rig(&emulator.port, "");
    let output = fixture.plumb(&["run", "rig.toml"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("no camera is plugged in"), "{}", stderr(&output));
    assert!(!fixture.path().join("runs").exists());
}

#[test]
fn settings_that_the_camera_lacks_are_refused() {
    let Some(fixture) = Fixture::new(true) else { return };
    let emulator = Emulator::start();
    for (camera, says) in [
        ("[camera.openni]\nwidth = 1280\nheight = 1024", "1280x1024"),
        ("[camera.openni]\nwidth = 320\nheight = 240", "principal point"),
        ("[camera.openni]\nuri = \"1d27/0609@9/9\"", "1d27/0609@9/9"),
        ("source = \"simulated\"", "no [simulation]"),
        ("source = \"recording\"", "recording"),
        ("recording = \"absent.oni\"", "absent.oni"),
        ("[camera.openni]\nlatency = -1.0", "latency"),
    ] {
        fixture.rig(&emulator.port, camera);
        let output = fixture.plumb(&["run", "rig.toml"]);
        assert_eq!(output.status.code(), Some(2), "{camera}: {}", stderr(&output));
        assert!(stderr(&output).contains(says), "{camera}: {}", stderr(&output));
    }
}

/// A run with `--record`: replays of both recordings make the same detections.
#[test]
fn a_replay_makes_the_detections_of_the_run() {
    let Some(fixture) = Fixture::new(true) else { return };
    let emulator = Emulator::start();
    fixture.rig(&emulator.port, "[camera.openni]\nintrinsics = \"device\"\nlatency = 0.005");
    let output = fixture.plumb(&["run", "rig.toml", "--record", "recording", "--out", "run"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("recorded: ") && !stderr(&output).contains("left out"),
        "{}",
        stderr(&output)
    );

    let run = rows(&fs::read_to_string(fixture.path().join("run/run.csv")).unwrap());
    let replayed = fixture.plumb(&["replay", "recording"]);
    assert!(replayed.status.success(), "{}", stderr(&replayed));
    let replayed = rows(&stdout(&replayed));
    assert_eq!(run.len(), replayed.len());
    let numbers =
        |row: &[String]| -> Vec<f64> { row.iter().map(|field| field.parse().unwrap()).collect() };
    for (run, replayed) in run.iter().zip(&replayed) {
        // u, v, radius and x, y, z, to the digits that both write.
        let (run, replayed) =
            ([&run[2..5], &run[6..9]].concat(), [&replayed[1..4], &replayed[5..8]].concat());
        for (a, b) in numbers(&run).iter().zip(numbers(&replayed)) {
            assert!((a - b).abs() < 2e-3, "{run:?} {replayed:?}");
        }
        let target = [0.400, 0.400, 0.150];
        assert!(
            numbers(&replayed[3..]).iter().zip(target).all(|(p, t)| (p - t).abs() < 0.004),
            "{replayed:?}"
        );
    }

    // The device's own recording has every frame of the device, also those that the run skipped.
    let oni = fixture.plumb(&["replay", "recording/recording.oni"]);
    assert!(oni.status.success(), "{}", stderr(&oni));
    let oni = rows(&stdout(&oni));
    assert!(oni.len() >= run.len(), "{} of {}", oni.len(), run.len());
    for row in &oni {
        assert_eq!(row[1..], replayed[0][1..], "the ball is at rest");
    }

    // Runs of the recordings from a rig file. They may end before the board reports.
    for (recording, out) in [("recording/recording.oni", "again"), ("recording", "once-more")] {
        fixture.rig(&emulator.port, &format!("recording = {recording:?}"));
        let again = fixture.plumb(&["run", "rig.toml", "--out", out, "--json"]);
        let summary: serde_json::Value = serde_json::from_str(&stdout(&again)).unwrap();
        assert!(
            again.status.success() || summary["ending"] == "no more pictures",
            "{recording}: {}",
            stderr(&again)
        );
        // A busy machine leaves overdue frames out.
        assert!(
            summary["located"].as_u64() >= Some(5) && summary["lost"] == 0,
            "{recording}: {summary}"
        );
    }
}

#[test]
fn unplugging_the_camera_ends_a_run_with_a_complete_folder() {
    let Some(mut fixture) = Fixture::new(true) else { return };
    // The ball is far from the target, so that the run goes on, and at rest, so that no error
    // grows.
    let ball = Some([0.0, 0.0, 1.2]);
    fixture.camera.write(&Control { ball, ..Fixture::control() }).unwrap();
    let emulator = Emulator::start();
    fixture.rig(&emulator.port, "");
    let mut command =
        fixture.command(&["run", "rig.toml", "--record", "recording", "--out", "run"]);
    let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    until_rows(&mut run, fixture.path(), 10);
    fixture.camera.write(&Control { plugged: false, ..Fixture::control() }).unwrap();
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("the camera was unplugged"), "{}", stderr(&output));
    let summary = fs::read_to_string(fixture.path().join("run/summary.json")).unwrap();
    assert!(summary.contains("unplugged"), "{summary}");
    assert!(fixture.path().join("run/figure4.svg").exists());
    for recording in ["recording", "recording/recording.oni"] {
        let replayed = fixture.plumb(&["replay", recording]);
        assert!(replayed.status.success(), "{recording}: {}", stderr(&replayed));
        assert!(rows(&stdout(&replayed)).len() >= 9, "{recording}");
    }
}

#[test]
fn a_silent_camera_ends_a_run() {
    let Some(mut fixture) = Fixture::new(true) else { return };
    fixture.camera.write(&Control { ball: Some([0.0, 0.0, 1.2]), ..Fixture::control() }).unwrap();
    let emulator = Emulator::start();
    fixture.rig(&emulator.port, "");
    let mut command = fixture.command(&["run", "rig.toml", "--out", "run"]);
    let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    until_rows(&mut run, fixture.path(), 3);
    fixture.camera.write(&Control { silent: true, ..Fixture::control() }).unwrap();
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("no picture for"), "{}", stderr(&output));
}

#[test]
fn a_truncated_recording_is_an_error() {
    let Some(fixture) = Fixture::new(true) else { return };
    let emulator = Emulator::start();
    fixture.rig(&emulator.port, "");
    let (path, whole) = fixture.record();
    fs::write(&path, &whole[..whole.len() * 2 / 3]).unwrap();
    let output = fixture.plumb(&["replay", "recording/recording.oni"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("recording.oni") && stderr(&output).contains("truncated"),
        "{}",
        stderr(&output)
    );
}

/// A file with bytes changed anywhere, or cut, gives rows or an error, never a crash of the program
/// or of the library in it.
#[test]
fn damaged_recordings_give_rows_or_an_error() {
    let Some(fixture) = Fixture::new(true) else { return };
    let emulator = Emulator::start();
    fixture.rig(&emulator.port, "[camera.openni]\nintrinsics = \"device\"\nlatency = 0.005");
    let (path, whole) = fixture.record();
    let sound = rows(&stdout(&fixture.plumb(&["replay", "recording/recording.oni"])));
    assert!(!sound.is_empty());
    // Most of the file is pictures. The bytes before and behind them are changed as often.
    let (head, tail) = (2000.min(whole.len()), whole.len().saturating_sub(1200));
    let mut random = 0x9E37_79B9_7F4A_7C15_u64;
    let mut below = |n: usize| {
        // xorshift64
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random % n as u64) as usize
    };
    let mut refused = 0;
    for case in 0..32 {
        let mut bytes = whole.clone();
        if case % 8 == 7 {
            bytes.truncate(below(whole.len()));
        }
        for _ in 0..[1, 3, 12][case % 3] {
            let at = match below(3) {
                0 => below(head),
                1 => tail + below(whole.len() - tail),
                _ => below(whole.len()),
            };
            let value = below(256) as u8;
            bytes.get_mut(at).into_iter().for_each(|byte| *byte = value);
        }
        fs::write(&path, bytes).unwrap();
        let output = fixture.plumb(&["replay", "recording/recording.oni"]);
        // A crash has no exit code.
        match output.status.code() {
            Some(0) => assert_eq!(rows(&stdout(&output)).len(), sound.len(), "case {case}"),
            // A damaged picture: its frame is lost and reported, the others are replayed.
            Some(1) => {
                refused += 1;
                let text = stderr(&output);
                let is_reported = text.contains(" broken") && !text.contains(" 0 broken");
                assert!(is_reported, "case {case}: {text}");
            }
            Some(2) => {
                refused += 1;
                let text = stderr(&output);
                assert!(text.contains("recording.oni"), "case {case}: {text}");
            }
            code => panic!("case {case}: {code:?}: {}", stderr(&output)),
        }
    }
    assert!(refused >= 16, "{refused} of 32");
}

#[test]
fn the_test_camera_has_the_intrinsics_of_the_camera_file() {
    let camera = plumb_cameras::camera_file::paper().unwrap();
    assert_eq!(camera.intrinsics.fx, FOCAL_LENGTH);
    let (u, v) = camera.intrinsics.project(&AT_TARGET.into()).unwrap();
    let target = camera.pose * camera.intrinsics.deproject(u, v, AT_TARGET[2]);
    assert!((target - nalgebra::Point3::new(0.4, 0.4, 0.15)).norm() < 1e-9, "{target}");
}
