//! Libraries and cameras that are found, that are missing and that are refused.

use std::fs;
use std::path::Path;
use std::process::Command;

use plumb_openni_driver::FOCAL_LENGTH;

use super::fixture::{AT_TARGET, Emulator, Fixture, stderr, stdout};

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
            .env(plumb_openni::LIBRARY_VARIABLE, "/no/such/libOpenNI2.so.0")
            .output()
            .unwrap();
        let text = stderr(&output);
        assert!(matches!(output.status.code(), Some(1 | 2)), "{text}");
        assert!(text.contains("libopenni2-0") && text.contains("/no/such"), "{text}");
    }
    // Another library under that path.
    let other = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .arg("cameras")
        .env(plumb_openni::LIBRARY_VARIABLE, "libc.so.6")
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
    let output = fixture.plumb(&["run"]);
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
        let output = fixture.plumb(&["run"]);
        assert_eq!(output.status.code(), Some(2), "{camera}: {}", stderr(&output));
        assert!(stderr(&output).contains(says), "{camera}: {}", stderr(&output));
    }
}

#[test]
fn the_test_camera_has_the_intrinsics_of_the_camera_file() {
    let camera = plumb_cameras::camera_file::paper().unwrap();
    assert_eq!(camera.intrinsics.fx, FOCAL_LENGTH);
    let (u, v) = camera.intrinsics.project(&AT_TARGET.into()).unwrap();
    let target = camera.pose * camera.intrinsics.deproject(u, v, AT_TARGET[2]);
    assert!((target - nalgebra::Point3::new(0.4, 0.4, 0.15)).norm() < 1e-9, "{target}");
}
