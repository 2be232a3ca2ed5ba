//! Recordings of a camera as MCAP files.

use std::fs;

use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_ros2::McapRecording;
use tempfile::TempDir;

use super::Target;
use crate::recording;

/// This target.
pub const TARGET: Target = Target {
    name: "mcap",
    input: "an MCAP file with messages of ROS 2 or of Foxglove",
    run,
    max_length: 4000,
    smoke: 2_000,
    words: &[
        "sensor_msgs/msg/Image",
        "sensor_msgs/msg/CompressedImage",
        "sensor_msgs/msg/CameraInfo",
        "foxglove.RawImage",
        "foxglove.CompressedImage",
        "foxglove.CameraCalibration",
        "cdr",
        "protobuf",
        "zstd",
        "lz4",
        "rgb8\0",
        "16UC1\0",
    ],
};

/// Column and row in the middle of the corpus's pictures, which have 4x2 pixels.
const MIDDLE: (f64, f64) = (1.5, 0.5);

thread_local! {
    /// The folder of the file, which each input replaces.
    static FOLDER: Option<TempDir> = tempfile::tempdir().ok();
}

/// Reads every frame of the file.
pub fn run(input: &[u8]) {
    let _frames = frames(input);
}

/// Returns the number of frames without an error; `None` where the file cannot be opened.
fn frames(input: &[u8]) -> Option<usize> {
    FOLDER.with(|folder| {
        let path = folder.as_ref()?.path().join("recording.mcap");
        fs::write(&path, input).ok()?;
        let intrinsics = recording::intrinsics(MIDDLE)?;
        let settings = Ros2CameraSettings::default();
        Some(recording::whole_frames(McapRecording::open(&path, intrinsics, &settings).ok()?))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_file_in_the_corpus_has_two_frames() {
        for file in [
            &include_bytes!("../../corpus/mcap/ros2")[..],
            include_bytes!("../../corpus/mcap/chunks"),
            include_bytes!("../../corpus/mcap/zstd"),
            include_bytes!("../../corpus/mcap/foxglove"),
        ] {
            assert_eq!(frames(file), Some(2), "a file of {} bytes", file.len());
        }
    }
}
