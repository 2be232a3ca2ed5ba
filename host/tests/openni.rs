//! The program with a camera: the real libOpenNI2 with the test driver of `tests/openni-driver` in
//! it.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use plumb_openni_driver::{CONTROL_VARIABLE, Control, ControlFile, FOCAL_LENGTH};
use tempfile::TempDir;

/// A folder with the library, a camera and a rig file.
struct Place {
    folder: TempDir,
    library: PathBuf,
    camera: ControlFile,
}

/// Where the rig file's target is for the camera of `rigs/camera.toml`: PT, 1.337 m before it.
const AT_TARGET: [f64; 3] = [0.400 - 0.286, -(0.150 - 0.225), 1.737 - 0.400];

impl Place {
    /// `None` where the library is not installed, but never with CI set.
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

    fn control() -> Control {
        Control { ball: Some(AT_TARGET), ..Control::default() }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command
            .args(arguments)
            .current_dir(self.path())
            .env(plumb_cameras::source::openni::LIBRARY_VARIABLE, &self.library)
            .env(CONTROL_VARIABLE, self.camera.path());
        command
    }

    fn plumb(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// The paper's rig file for a board on `port`, without its simulated rig and with `camera` as
    /// its camera.
    fn rig(&self, port: &str, camera: &str) {
        let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
        let text = fs::read_to_string(rigs.join("paper.toml")).unwrap();
        let text = text[..text.find("\n[simulation]").unwrap()].replace("/dev/ttyACM0", port);
        let text =
            text.replace("file = \"camera.toml\"", &format!("file = \"camera.toml\"\n{camera}"));
        // What is looked at here is not how busy the machine is.
        let text =
            text.replace("host = 0.3", "host = 5.0").replace("position = 0.5", "position = 5.0");
        let text = text.replace("max_age = 0.25", "max_age = 4.9");
        fs::write(self.path().join("rig.toml"), text).unwrap();
        fs::copy(rigs.join("camera.toml"), self.path().join("camera.toml")).unwrap();
    }
}

/// `plumb emulate` in the background, one at a time, since boards have deadlines; killed when
/// dropped.
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

/// Waits until the run has so many rows; or until it has ended, which the test will see.
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

/// The columns of a CSV's rows, without its header.
fn rows(text: &str) -> Vec<Vec<String>> {
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn without_the_library_its_package_is_named() {
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
    // A library that is another one.
    let other = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .arg("cameras")
        .env(plumb_cameras::source::openni::LIBRARY_VARIABLE, "libc.so.6")
        .output()
        .unwrap();
    assert!(stderr(&other).contains("not OpenNI 2.2"), "{}", stderr(&other));
}

#[test]
fn cameras_lists_what_is_there() {
    let Some(place) = Place::new(true) else { return };
    let output = place.plumb(&["cameras", "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(json["cameras"][0]["uri"], place.camera.uri());
    assert_eq!(json["cameras"][0]["name"], "Plumb test camera");
    let drivers = &json["openni"]["loaded"]["drivers"];
    assert_eq!(drivers, &serde_json::json!(["libOniFile.so.0", "libPlumbTest.so.0"]));
}

#[test]
fn without_a_camera_it_is_said() {
    let Some(place) = Place::new(false) else { return };
    let output = place.plumb(&["cameras"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("missing: "), "{}", stderr(&output));
    let emulator = Emulator::start();
    place.rig(&emulator.port, "");
    let output = place.plumb(&["run", "rig.toml"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("no camera is plugged in"), "{}", stderr(&output));
    assert!(!place.path().join("runs").exists());
}

#[test]
fn a_camera_that_cannot_be_what_the_rig_file_says_is_refused() {
    let Some(place) = Place::new(true) else { return };
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
        place.rig(&emulator.port, camera);
        let output = place.plumb(&["run", "rig.toml"]);
        assert_eq!(output.status.code(), Some(2), "{camera}: {}", stderr(&output));
        assert!(stderr(&output).contains(says), "{camera}: {}", stderr(&output));
    }
}

/// A run through the library with `--record`, both its recordings replayed: the same detections.
#[test]
fn what_a_run_sees_is_what_is_replayed() {
    let Some(place) = Place::new(true) else { return };
    let emulator = Emulator::start();
    place.rig(&emulator.port, "[camera.openni]\nintrinsics = \"device\"\nlatency = 0.005");
    let output = place.plumb(&["run", "rig.toml", "--record", "recording", "--out", "run"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("recorded: ") && !stderr(&output).contains("left out"),
        "{}",
        stderr(&output)
    );

    let run = rows(&fs::read_to_string(place.path().join("run/run.csv")).unwrap());
    let replayed = place.plumb(&["replay", "recording"]);
    assert!(replayed.status.success(), "{}", stderr(&replayed));
    let replayed = rows(&stdout(&replayed));
    assert_eq!(run.len(), replayed.len());
    let numbers =
        |row: &[String]| -> Vec<f64> { row.iter().map(|field| field.parse().unwrap()).collect() };
    for (run, replayed) in run.iter().zip(&replayed) {
        // u, v, radius and x, y, z, to what both write.
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

    // The device's own recording has every picture of the device, also those that the run was too
    // slow for.
    let oni = place.plumb(&["replay", "recording/recording.oni"]);
    assert!(oni.status.success(), "{}", stderr(&oni));
    let oni = rows(&stdout(&oni));
    assert!(oni.len() >= run.len(), "{} of {}", oni.len(), run.len());
    for row in &oni {
        assert_eq!(row[1..], replayed[0][1..], "the ball hangs still");
    }

    // And runs of the recordings, in a rig file; they may be over before the board has said that it
    // is there.
    for (recording, out) in [("recording/recording.oni", "again"), ("recording", "once-more")] {
        place.rig(&emulator.port, &format!("recording = {recording:?}"));
        let again = place.plumb(&["run", "rig.toml", "--out", out, "--json"]);
        let summary: serde_json::Value = serde_json::from_str(&stdout(&again)).unwrap();
        assert!(
            again.status.success() || summary["ending"] == "no more pictures",
            "{recording}: {}",
            stderr(&again)
        );
        assert!(
            summary["located"].as_u64() >= Some(9) && summary["lost"] == 0,
            "{recording}: {summary}"
        );
    }
}

#[test]
fn pulling_the_cameras_plug_ends_a_run_with_its_folder_whole() {
    let Some(mut place) = Place::new(true) else { return };
    // Far from its target, so that the run goes on; it hangs still, so that nothing grows.
    let ball = Some([0.0, 0.0, 1.2]);
    place.camera.write(&Control { ball, ..Place::control() }).unwrap();
    let emulator = Emulator::start();
    place.rig(&emulator.port, "");
    let mut command = place.command(&["run", "rig.toml", "--record", "recording", "--out", "run"]);
    let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    until_rows(&mut run, place.path(), 10);
    place.camera.write(&Control { plugged: false, ..Place::control() }).unwrap();
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("the camera was unplugged"), "{}", stderr(&output));
    let summary = fs::read_to_string(place.path().join("run/summary.json")).unwrap();
    assert!(summary.contains("unplugged"), "{summary}");
    assert!(place.path().join("run/figure4.svg").exists());
    for recording in ["recording", "recording/recording.oni"] {
        let replayed = place.plumb(&["replay", recording]);
        assert!(replayed.status.success(), "{recording}: {}", stderr(&replayed));
        assert!(rows(&stdout(&replayed)).len() >= 9, "{recording}");
    }
}

#[test]
fn a_camera_that_falls_silent_ends_a_run() {
    let Some(mut place) = Place::new(true) else { return };
    place.camera.write(&Control { ball: Some([0.0, 0.0, 1.2]), ..Place::control() }).unwrap();
    let emulator = Emulator::start();
    place.rig(&emulator.port, "");
    let mut command = place.command(&["run", "rig.toml", "--out", "run"]);
    let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    until_rows(&mut run, place.path(), 3);
    place.camera.write(&Control { silent: true, ..Place::control() }).unwrap();
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("no picture for"), "{}", stderr(&output));
}

#[test]
fn a_truncated_recording_is_an_error() {
    let Some(place) = Place::new(true) else { return };
    let emulator = Emulator::start();
    place.rig(&emulator.port, "");
    assert!(
        place.plumb(&["run", "rig.toml", "--record", "recording", "--out", "run"]).status.success()
    );
    let path = place.path().join("recording/recording.oni");
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() * 2 / 3]).unwrap();
    let output = place.plumb(&["replay", "recording/recording.oni"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("recording.oni") && stderr(&output).contains("truncated"),
        "{}",
        stderr(&output)
    );
}

/// The program, and the library in it, given a file with bytes changed anywhere, or cut: rows or an
/// error, never a crash.
#[test]
fn damaged_recordings_give_rows_or_an_error() {
    let Some(place) = Place::new(true) else { return };
    let emulator = Emulator::start();
    place.rig(&emulator.port, "[camera.openni]\nintrinsics = \"device\"\nlatency = 0.005");
    assert!(
        place.plumb(&["run", "rig.toml", "--record", "recording", "--out", "run"]).status.success()
    );
    let path = place.path().join("recording/recording.oni");
    let whole = fs::read(&path).unwrap();
    let sound = rows(&stdout(&place.plumb(&["replay", "recording/recording.oni"])));
    assert!(!sound.is_empty());
    // Most of the file is pictures: what is before them and behind them is hit as often.
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
        let output = place.plumb(&["replay", "recording/recording.oni"]);
        // A crash has no code.
        match output.status.code() {
            Some(0) => assert_eq!(rows(&stdout(&output)).len(), sound.len(), "case {case}"),
            Some(1 | 2) => {
                refused += 1;
                assert!(
                    stderr(&output).contains("recording.oni"),
                    "case {case}: {}",
                    stderr(&output)
                );
            }
            code => panic!("case {case}: {code:?}: {}", stderr(&output)),
        }
    }
    assert!(refused >= 16, "{refused} of 32");
}

#[test]
fn the_test_cameras_lens_is_that_of_the_camera_file() {
    let camera = plumb_cameras::camera_file::paper().unwrap();
    assert_eq!(camera.intrinsics.fx, FOCAL_LENGTH);
    let (u, v) = camera.intrinsics.project(&AT_TARGET.into()).unwrap();
    let target = camera.pose * camera.intrinsics.deproject(u, v, AT_TARGET[2]);
    assert!((target - nalgebra::Point3::new(0.4, 0.4, 0.15)).norm() < 1e-9, "{target}");
}
