//! The program with a RealSense camera, through the real librealsense2: the library, its absence,
//! cameras that are missing, settings that are refused, and recordings.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::ops::RangeInclusive;
use std::path::Path;
use std::process::{Command, Output};

use plumb_realsense::{Camera, Settings, Target};
use plumb_realsense_device::{Control, Model, SoftwareCamera, Stamp, UNIT, installed, library};
use tempfile::TempDir;

use crate::common::{Emulator, folder, rigs, stderr};

/// Pairs that are recorded.
const PAIRS: usize = 30;

/// Writes the paper's rig file for a board on `port`, without its simulated rig and with the lines
/// `camera` in its table `[camera]`.
fn rig(folder: &TempDir, port: &str, camera: &str) {
    let text = fs::read_to_string(rigs().join("paper.toml")).unwrap();
    let text = text[..text.find("\n[simulation]").unwrap()]
        .replace("/dev/ttyACM0", port)
        .replace("file = \"camera.toml\"", &format!("file = \"camera.toml\"\n{camera}"));
    fs::write(folder.path().join("rig.toml"), text).unwrap();
    fs::copy(rigs().join("camera.toml"), folder.path().join("camera.toml")).unwrap();
}

/// Runs the program in `folder` with the library at `library`.
fn plumb(folder: &TempDir, library: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(arguments)
        .current_dir(folder.path())
        .env(plumb_realsense::LIBRARY_VARIABLE, library)
        .output()
        .unwrap()
}

#[test]
fn an_absent_library_is_reported_with_the_way_to_get_it() {
    let folder = folder();
    let emulator = Emulator::start();
    rig(&folder, &emulator.port, "source = \"realsense\"");
    for bag in ["a.bag", "A.BAG"] {
        fs::write(folder.path().join(bag), "").unwrap();
    }
    let replay = ["replay", "a.bag", "--camera", "camera.toml"];
    let capitals = ["replay", "A.BAG", "--camera", "camera.toml"];
    for arguments in [&["cameras"][..], &["run"], &replay, &capitals] {
        let output = plumb(&folder, Path::new("/no/such/librealsense2.so"), arguments);
        assert!(matches!(output.status.code(), Some(1 | 2)), "{}", stderr(&output));
        for part in ["pip install pyrealsense2", "Intel", "/no/such"] {
            assert!(stderr(&output).contains(part), "{part}: {}", stderr(&output));
        }
    }
    let output = plumb(&folder, Path::new("libc.so.6"), &["run"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("not librealsense 2.50"), "{}", stderr(&output));
}

#[test]
fn the_library_is_listed_and_an_absent_camera_refused() {
    if library().unwrap().is_none() {
        return;
    }
    let (folder, path) = (folder(), installed().unwrap());
    let output = plumb(&folder, &path, &["cameras", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let version = json["realsense"]["loaded"]["version"].as_str().unwrap_or_default();
    assert!(version.starts_with("2."), "{json}");
    let emulator = Emulator::start();
    for (camera, says) in [
        ("source = \"realsense\"", "no RealSense camera is plugged in"),
        ("source = \"realsense\"\n[camera.realsense]\nserial = \"0815\"", "0815"),
        ("source = \"realsense\"\n[camera.realsense]\nexposure = 0.0", "exposure"),
        ("source = \"realsense\"\n[camera.realsense]\nlaser = true", "laser"),
        ("source = \"realsense\"\nrecording = \"a.db3\"", "names a recording"),
        ("recording = \"absent.db3\"", "absent.db3"),
    ] {
        rig(&folder, &emulator.port, camera);
        let output = plumb(&folder, &path, &["run"]);
        assert_eq!(output.status.code(), Some(2), "{camera}: {}", stderr(&output));
        assert!(stderr(&output).contains(says), "{camera}: {}", stderr(&output));
    }
}

#[test]
fn a_recording_is_replayed_with_its_own_intrinsics() {
    let Some(library) = library().unwrap() else { return };
    let folder = folder();
    let path = folder.path().join("recording.db3");
    let device = SoftwareCamera::plug_in(&library, "recorded", Model::default()).unwrap();
    let settings = Settings { record: Some(path), ..Settings::default() };
    let target = Target::Serial("recorded".to_owned());
    let mut camera = Camera::open(&library, &target, settings).unwrap();
    // The paper's target in the axes of the camera of `rigs/camera.toml`.
    let scene = Control { ball: Some([0.114, 0.075, 1.337]), ..Control::default() };
    for number in 0..PAIRS {
        let stamp = Stamp::at(1000.0 + number as f64 / 30.0);
        device.send_colour(&scene, stamp).unwrap();
        device.send_depth(&scene, stamp, UNIT).unwrap();
        assert!(camera.next_pair().unwrap().is_some());
    }
    drop(camera);

    rig(&folder, "/dev/ttyACM0", "");
    let arguments = ["replay", "recording.db3", "--camera", "camera.toml"];
    let mut output = plumb(&folder, &installed().unwrap(), &arguments);
    // The library's recorder may leave out frames at the end, and on a busy machine single pictures
    // at the start: those frames are told as broken, with exit code 1, and have no position.
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", stderr(&output));
    let rows = String::from_utf8_lossy(&output.stdout).into_owned();
    let located: Vec<&str> = rows.lines().filter(|row| !row.contains(",,")).collect();
    output.stdout = located.join("\n").into_bytes();
    assert_rows_at_the_target(&output, PAIRS - 16..=PAIRS);
}

#[test]
fn a_bag_of_an_earlier_library_is_replayed_with_positions() {
    if library().unwrap().is_none() {
        return;
    }
    // `tests/realsense-device/bag/record.py` recorded six pairs with the library 2.56.5.
    let folder = folder();
    let bag = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/realsense-device/bag/ball.bag");
    fs::copy(bag, folder.path().join("ball.bag")).unwrap();
    rig(&folder, "/dev/ttyACM0", "");
    let arguments = ["replay", "ball.bag", "--camera", "camera.toml"];
    let output = plumb(&folder, &installed().unwrap(), &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_rows_at_the_target(&output, 4..=6);
}

/// Checks the number of rows of `plumb replay`, and that each has the paper's target.
fn assert_rows_at_the_target(output: &Output, count: RangeInclusive<usize>) {
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let rows: Vec<&str> = text.lines().skip(1).collect();
    assert!(count.contains(&rows.len()), "{} rows", rows.len());
    for row in rows {
        let position: Vec<f64> =
            row.split(',').skip(5).take(3).map(|field| field.parse().unwrap()).collect();
        let is_near = |(at, is): (&f64, f64)| (at - is).abs() < 0.004;
        assert!(position.iter().zip([0.4, 0.4, 0.15]).all(is_near), "{row}");
    }
}
