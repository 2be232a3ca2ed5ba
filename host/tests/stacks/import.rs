//! `plumb calibrate --import`: lenses and poses that other programs have found.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::Path;
use std::process::Output;

use plumb_cameras::camera_file;

use crate::common::{folder, json, plumb, rig_file, stderr};

const LENS: &str = "image_width: 640\nimage_height: 480\ncamera_name: desk\ncamera_matrix:\n  \
                    rows: 3\n  cols: 3\n  \
                    data: [605.25, 0., 322.5, 0., 606.75, 241.5, 0., 0., 1.]\n\
                    distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  \
                    data: [-0.25, 0.125, 0.0005, -0.00025, 0.]\n";

/// Runs the command with a calibration file of this text.
fn import(text: &str, options: &[&str], folder: &Path) -> Output {
    let rig = rig_file(folder, |text| text);
    fs::write(folder.join("other.yaml"), text).unwrap();
    let arguments = ["calibrate", "--rig", &rig, "--import", "other.yaml", "--yes", "--json"];
    plumb(&[&arguments[..], options].concat(), folder)
}

/// Returns a result of easy_handeye with this place and rotation (x, y, z, w).
fn hand_eye([x, y, z]: [f64; 3], [qx, qy, qz, qw]: [f64; 4]) -> String {
    format!(
        "parameters:\n  eye_on_hand: false\n  robot_base_frame: rig\n  \
         tracking_base_frame: camera_color_optical_frame\ntransformation:\n  \
         {{qw: {qw}, qx: {qx}, qy: {qy}, qz: {qz}, x: {x}, y: {y}, z: {z}}}\n"
    )
}

#[test]
fn a_lens_is_written_and_the_pose_stays() {
    let folder = folder();
    let output = import(LENS, &[], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let result = json(&output);
    assert_eq!((&result["content"], &result["written"]), (&"lens".into(), &true.into()));
    assert!(stderr(&output).contains("640x480"), "{}", stderr(&output));
    let camera = camera_file::read(&folder.path().join("camera.toml")).unwrap();
    let lens = camera.intrinsics;
    assert_eq!([lens.fx, lens.fy, lens.cx, lens.cy], [605.25, 606.75, 322.5, 241.5]);
    let coefficients = lens.distortion.unwrap().coefficients().to_array();
    assert_eq!(coefficients, [-0.25, 0.125, 0.0005, -0.00025, 0.0]);
    let old = camera_file::read(&folder.path().join("camera.toml.bak")).unwrap();
    assert_eq!((camera.pose, lens.depth_scale), (old.pose, old.intrinsics.depth_scale));
}

#[test]
fn a_lens_that_a_run_ignores_comes_with_the_line_to_write() {
    let folder = folder();
    fs::write(folder.path().join("other.yaml"), LENS).unwrap();
    for (intrinsics, is_ignored) in [("device", true), ("file", false)] {
        let lines =
            format!("[camera]\nsource = \"realsense\"\nrealsense.intrinsics = \"{intrinsics}\"\n");
        let rig = rig_file(folder.path(), |text| text.replacen("[camera]\n", &lines, 1));
        let arguments = ["calibrate", "--rig", &rig, "--import", "other.yaml", "--yes"];
        let text = stderr(&plumb(&arguments, folder.path()));
        let says = "set `intrinsics = \"file\"` in [camera.realsense] of";
        assert_eq!(text.contains(says), is_ignored, "{intrinsics}: {text}");
    }
}

#[test]
fn the_size_of_the_pictures_is_needed() {
    let folder = folder();
    let text = "camera_matrix: [[605, 0, 322], [0, 606, 241], [0, 0, 1]]\ndist: [0, 0, 0, 0, 0]";
    let output = import(text, &[], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("--import-size"), "{}", stderr(&output));
    let output = import(text, &["--import-size", "640x480"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for wrong in ["640", "0x480", "640x70000", "640x-1"] {
        let output = import(text, &["--import-size", wrong], folder.path());
        assert_eq!(output.status.code(), Some(2), "{wrong}: {}", stderr(&output));
    }
}

#[test]
fn a_pose_is_written_and_one_that_is_the_inverse_is_told() {
    let (place, rotation) = ([1.737, 0.286, 0.225], [-0.5, -0.5, 0.5, 0.5]);
    let folder = folder();
    let output = import(&hand_eye(place, rotation), &[], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(json(&output)["findings"].as_array().unwrap().len(), 0, "{}", stderr(&output));
    assert!(stderr(&output).contains("`rig` must be the rig frame"), "{}", stderr(&output));
    let pose = camera_file::read(&folder.path().join("camera.toml")).unwrap().pose;
    assert!((pose.translation.vector - nalgebra::Vector3::from(place)).norm() < 1e-9);

    // The rig in the camera's axes: what tf calls the transform from the camera to the base.
    let inverse = pose.inverse();
    let (t, q) = (inverse.translation.vector, inverse.rotation.coords);
    let text = hand_eye([t.x, t.y, t.z], [q.x, q.y, q.z, q.w]);
    let output = import(&text, &[], folder.path());
    assert!(stderr(&output).contains("the inverse of this pose sees it"), "{}", stderr(&output));
}

#[test]
fn nothing_is_written_of_a_file_that_is_refused() {
    let folder = folder();
    for (text, word) in [
        ("a: 1\nb: 2\n", "kalibr"),
        ("<?xml version=\"1.0\"?>", "XML"),
        (&LENS.replace("plumb_bob", "equidistant"), "equidistant"),
    ] {
        let output = import(text, &[], folder.path());
        assert_eq!(output.status.code(), Some(2), "{text}: {}", stderr(&output));
        assert!(stderr(&output).contains(word), "{}", stderr(&output));
        assert!(stderr(&output).contains("other.yaml"), "{}", stderr(&output));
    }
    // A lens that bends back inside its pictures is none of a camera file.
    let bent = LENS.replace("-0.25, 0.125", "-2.5, 0.0");
    let output = import(&bent, &[], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("no inverse"), "{}", stderr(&output));
    assert!(!folder.path().join("camera.toml.bak").exists());
}
