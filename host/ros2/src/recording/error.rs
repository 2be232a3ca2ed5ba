//! Errors of MCAP recordings.

use std::io;
use std::path::PathBuf;

use plumb_cameras::ros2::TopicNameError;
use plumb_frame::file_intrinsics::UnfitIntrinsics;
use thiserror::Error;

use crate::camera::Ros2CameraError;

/// Failure to read an MCAP recording.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum McapError {
    /// The file cannot be read.
    #[error("{}: cannot be read", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Reason of the operating system.
        #[source]
        error: io::Error,
    },
    /// The file is no MCAP, or damaged from a place on.
    #[error("{}: {}", .path.display(), advice(.error))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Violated condition.
        #[source]
        error: mcap::McapError,
    },
    /// No topic has pictures that are read.
    #[error(
        "{}: none of its topics has colour pictures of ROS 2 (sensor_msgs/Image or \
         CompressedImage, CDR) or Foxglove (RawImage or CompressedImage, protobuf). Its topics: \
         {topics}",
        .path.display()
    )]
    NoColour {
        /// The file.
        path: PathBuf,
        /// Topics with their types.
        topics: String,
    },
    /// Several topics may be the camera's.
    #[error(
        "{}: several topics may be the camera's {what}: {topics}. Name one as `{key}` in \
         [camera.ros2] of the rig file, or keep one (`mcap filter --include-topic-regex`)",
        .path.display()
    )]
    Several {
        /// The file.
        path: PathBuf,
        /// "colour" or "depth".
        what: &'static str,
        /// Key of the rig file.
        key: &'static str,
        /// The topics.
        topics: String,
    },
    /// No topic has depth, which the camera file expects.
    #[error(
        "{}: has no topic with depth aligned to colour. For a recording without depth, such as \
         one of `--mcap`, set `depth_scale = \"none\"` in the camera file; to keep that of the \
         rig, give `plumb replay` a copy with --camera. Its topics: {topics}",
        .path.display()
    )]
    NoDepth {
        /// The file.
        path: PathBuf,
        /// Topics with their types.
        topics: String,
    },
    /// A message is none of its type.
    #[error("{topic}: a message is no {name}")]
    Message {
        /// Name of the topic.
        topic: String,
        /// Name of the type.
        name: String,
    },
    /// A topic in the rig file has an impossible name.
    #[error(transparent)]
    Topic(#[from] TopicNameError),
    /// A picture or a description of the camera is wrong.
    #[error(transparent)]
    Camera(#[from] Ros2CameraError),
    /// The intrinsics of the camera file do not fit the pictures.
    #[error(transparent)]
    UnfitIntrinsics(#[from] UnfitIntrinsics),
}

/// Returns what a person can do about a file that is damaged or of another kind.
fn advice(error: &mcap::McapError) -> &'static str {
    match error {
        mcap::McapError::BadMagic => "this is no MCAP file",
        mcap::McapError::UnexpectedEof => {
            "the file ends within a record: its recorder was killed, or it was copied in part. \
             `mcap recover` saves the rest"
        }
        mcap::McapError::UnsupportedCompression(_) => {
            "its compression is not read: write it anew with `mcap compress --compression zstd`"
        }
        _ => "the file is damaged; `mcap recover` saves the rest",
    }
}
