//! Camera files.

use std::path::Path;

use plumb_cameras::camera_file;

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "camera_file",
    input: "the text of a camera file",
    run,
    max_length: 2000,
    smoke: 300,
    words: &[
        "k1 = ",
        "k2 = ",
        "p1 = ",
        "k3 = ",
        "fx = ",
        "depth_scale = ",
        "\"none\"",
        "[pose]",
        "[ball]",
        "inf",
        "nan",
        "-1",
        "0.0",
        "1e308",
        "1e-320",
        "quaternion = ",
        "[0, 0, 0, 1]",
        "\n",
    ],
};

/// Parses the input, and lists its mistakes. A file that is read has none.
pub fn run(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    let mistakes = camera_file::mistakes(&text);
    match camera_file::parse(Path::new("camera.toml"), &text) {
        Ok(camera) => {
            assert!(mistakes.is_empty(), "{mistakes:?} of a camera file that is read");
            let pose = camera.pose;
            assert!(pose.translation.vector.iter().all(|c| c.is_finite()), "{pose}");
        }
        Err(error) => assert!(!mistakes.is_empty(), "no mistake, but: {error}"),
    }
}
