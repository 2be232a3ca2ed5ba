//! Messages of a camera in ROS 2.

use plumb_ros2::fuzzing;

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "ros2_camera",
    input: "a byte order, then the CDR of Image, CompressedImage or CameraInfo",
    run,
    max_length: 2000,
    smoke: 5_000,
    words: &[
        "rgb8\0",
        "bgr8\0",
        "bayer_rggb8\0",
        "16UC1\0",
        "32FC1\0",
        "jpeg\0",
        "png\0",
        "16UC1; compressedDepth png\0",
        "32FC1; compressedDepth rvl\0",
        "plumb_bob\0",
    ],
};

/// Reads the message and decodes its picture.
pub fn run(input: &[u8]) {
    let _decoded = fuzzing::camera(input);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_messages_in_the_corpus_are_decoded() {
        for message in [
            &include_bytes!("../../corpus/ros2_camera/colour")[..],
            include_bytes!("../../corpus/ros2_camera/depth"),
            include_bytes!("../../corpus/ros2_camera/compressed"),
            include_bytes!("../../corpus/ros2_camera/compressed_depth"),
            include_bytes!("../../corpus/ros2_camera/compressed_depth_rvl"),
            include_bytes!("../../corpus/ros2_camera/bayer"),
            include_bytes!("../../corpus/ros2_camera/info"),
        ] {
            assert!(fuzzing::camera(message), "{message:?}");
        }
    }
}
