//! The program without its optional parts, as `make demo` builds it: each says how to build it.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::Path;

use crate::common::{folder, plumb, rigs, stderr};

/// Runs the program in `folder`, expects that it refuses its input, and returns what it says.
fn refusal(arguments: &[&str], folder: &Path) -> String {
    let output = plumb(arguments, folder);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    text
}

#[test]
fn outputs_for_viewers() {
    let folder = folder();
    for option in ["--mcap=run.mcap", "--foxglove"] {
        let demo = ["demo", "--virtual-time", option, "--out", "run"];
        let text = refusal(&demo, folder.path());
        assert!(text.contains("--features foxglove"), "{text}");
        assert!(!folder.path().join("run").exists(), "nothing moves");
    }
}

#[test]
fn calibrations_of_other_programs() {
    let folder = folder();
    let text = refusal(&["calibrate", "--rig", "rig.toml", "--import", "lens.yaml"], folder.path());
    assert!(text.contains("--features import"), "{text}");
}

#[test]
fn ros_2() {
    let folder = folder();
    let text = refusal(&["demo", "--ros2", "--out", "run"], folder.path());
    assert!(text.contains("--features ros2"), "{text}");
    assert!(!folder.path().join("run").exists(), "nothing moves");

    fs::write(folder.path().join("bag.mcap"), "").unwrap();
    let camera = rigs().join("camera.toml");
    let replay = ["replay", "bag.mcap", "--camera", camera.to_str().unwrap()];
    let text = refusal(&replay, folder.path());
    assert!(text.contains("bag.mcap") && text.contains("--features ros2"), "{text}");
}

#[test]
fn video_files() {
    let folder = folder();
    fs::copy(rigs().join("camera.toml"), folder.path().join("camera.toml")).unwrap();
    fs::write(folder.path().join("clip.avi"), "").unwrap();
    let text = refusal(&["replay", "clip.avi", "--camera", "camera.toml"], folder.path());
    assert!(text.contains("clip.avi") && text.contains("--features videoio"), "{text}");
}
