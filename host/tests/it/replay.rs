//! `plumb replay`: real pictures, and recordings with broken files.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{folder, plumb, rigs, stderr};

#[test]
fn the_desk_has_no_ball() {
    let Some(desk) = data("tum-desk") else { return };
    let camera = rigs().join("camera.toml");
    let output = plumb(
        &["replay", desk.to_str().unwrap(), "--camera", camera.to_str().unwrap()],
        Path::new("."),
    );
    assert!(output.status.success(), "{}", stderr(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.starts_with("time_s,u_px,") && text.ends_with("\n0.000000,,,,,,,,\n"), "{text}");
}

/// Real pictures; without them the test is passed over, but never with CI set.
fn data(name: &str) -> Option<PathBuf> {
    let base = std::env::var_os("PLUMB_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
        PathBuf::from,
    );
    let folder = base.join(name);
    if folder.join("rgb.txt").exists() {
        return Some(folder);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is not there", folder.display());
    println!("skipped: {} is not there (set PLUMB_DATA)", folder.display());
    None
}

#[test]
fn replay_names_broken_files_and_goes_on() {
    let folder = folder();
    fs::write(
        folder.path().join("rgb.txt"),
        "# two\n0.0 rgb/absent.png\n0.1 rgb/broken.png\nnonsense\n",
    )
    .unwrap();
    fs::write(folder.path().join("depth.txt"), "0.0 depth/absent.png\n").unwrap();
    fs::create_dir(folder.path().join("rgb")).unwrap();
    fs::write(folder.path().join("rgb/broken.png"), [0x89, b'P', b'N', b'G', 1, 2, 3]).unwrap();
    let camera = rigs().join("camera.toml");
    let output = plumb(&["replay", ".", "--camera", camera.to_str().unwrap()], folder.path());
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.contains("absent.png") && text.contains("broken.png") && text.contains("rgb.txt:4"),
        "{text}"
    );
    assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 3);
}

#[test]
fn another_depth_scale_than_that_of_the_recording_is_warned_about() {
    let folder = folder();
    for (name, text) in [("rgb.txt", "0.0 rgb/absent.png\n"), ("depth.txt", "0.0 d/absent.png\n")] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let text = fs::read_to_string(rigs().join("camera.toml")).unwrap();
    let scale = text.lines().find(|line| line.starts_with("depth_scale = ")).unwrap();
    for (name, text) in
        [("camera.toml", &text), ("other.toml", &text.replace(scale, "depth_scale = 77.0"))]
    {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let warns = |camera: &[&str]| {
        let output = plumb(&[&["replay", "."], camera].concat(), folder.path());
        stderr(&output).contains("warning: other.toml: depth_scale = 77, but the file of the reco")
    };
    assert!(warns(&["--camera", "other.toml"]));
    assert!(!warns(&["--camera", "camera.toml"]) && !warns(&[]));
}
