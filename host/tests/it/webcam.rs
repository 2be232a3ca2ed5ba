//! Webcams, as a user meets them: what cannot be opened is refused. No camera is needed.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::Path;
use std::process::Output;

use crate::common::{folder, plumb, rig_file, stderr};

/// Returns the output of a calibration, which opens the camera and no board, with a webcam.
fn open(folder: &Path, device: &str) -> Output {
    let rig = rig_file(folder, |text| {
        let simulation = text.find("[simulation]").unwrap();
        let text = text[..simulation].replace(
            "file = \"camera.toml\"",
            &format!("file = \"camera.toml\"\nsource = \"webcam\"\nwebcam.device = {device:?}"),
        );
        assert!(text.contains("webcam.device"));
        text
    });
    plumb(&["calibrate", "--rig", &rig, "--motors", "--height", "0.7"], folder)
}

#[test]
fn what_is_no_webcam_is_refused() {
    let folder = folder();
    fs::write(folder.path().join("clip.avi"), "no video").unwrap();
    let file = folder.path().join("clip.avi").to_str().unwrap().to_owned();
    let cases = [
        ("/dev/nosuchcamera", "plumb cameras"),
        (file.as_str(), "a video file is a recording"),
        ("/dev/null", "it is no camera"),
    ];
    for (device, message) in cases {
        let output = open(folder.path(), device);
        let text = stderr(&output);
        assert_ne!(output.status.code(), Some(0), "{text}");
        assert!(text.contains(device) && text.contains(message), "{text}");
    }
}
