//! Frames of other programs.

use plumb_cameras::{camera_file, fuzzing};

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "stream",
    input: "a sender's frames: a line of JSON and the bytes of two pictures each",
    run,
    max_length: 4000,
    smoke: 2_000,
    words: &[
        "\"t\": ",
        "\"width\": ",
        "\"height\": ",
        "\"rgb8\"",
        "\"bgr8\"",
        "\"jpeg\"",
        "\"png\"",
        "\"z16\"",
        "\"png16\"",
        "\"none\"",
        "\"depth_scale\": ",
        "\"age\": ",
        "\"depth_bytes\": ",
        "\"colour_bytes\": ",
        "1e10",
        "-1",
        "8192",
        "\n",
        "{",
        "}",
    ],
};

/// Reads and decodes the frames.
pub fn run(input: &[u8]) {
    let Ok(camera) = camera_file::paper() else { return };
    let _frames = fuzzing::stream(input, camera.intrinsics);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frames_in_the_corpus_are_decoded() {
        let intrinsics = camera_file::paper().unwrap().intrinsics;
        for (frames, count) in [
            (&include_bytes!("../../corpus/stream/raw")[..], 2),
            (include_bytes!("../../corpus/stream/png"), 1),
        ] {
            assert_eq!(fuzzing::stream(frames, intrinsics), count);
        }
    }
}
