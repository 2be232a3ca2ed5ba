//! Table `[camera.ros2]` of a rig file. The crate `plumb-ros2` reads such a camera.

use std::net::IpAddr;

use serde::Deserialize;

use super::openni::IntrinsicsFrom;
use crate::toml_file::{CameraTime, domain};

/// Settings of a camera in ROS 2: table `[camera.ros2]` of a rig file. Every key may be left out.
/// The topics are by default those of realsense-ros with the camera's default name.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ros2CameraSettings {
    /// Topic of the colour pictures, `sensor_msgs/Image`; of `sensor_msgs/CompressedImage` where
    /// the name ends with `/compressed`.
    pub colour: String,
    /// Topic of the depth pictures, aligned to colour; `"none"` for a camera without depth.
    pub depth: String,
    /// Topic of the camera's description, `sensor_msgs/CameraInfo`.
    pub info: String,
    /// Domain of ROS 2, 0 to 232. Default: the variable `ROS_DOMAIN_ID`, else 0.
    #[serde(deserialize_with = "domain")]
    pub domain: Option<u16>,
    /// Address of the only network interface for ROS 2. Default: all of them, or 127.0.0.1 where
    /// ROS 2's variables ask for it.
    pub interface: Option<IpAddr>,
    /// Time from exposure to the earliest arrival of a picture, seconds, above 0, to 10. Default:
    /// 0.045.
    pub latency: Option<CameraTime>,
    /// Origin of the intrinsics. Default: `"device"`, which the topic `info` has.
    pub intrinsics: IntrinsicsFrom,
    /// Whether the pictures are rectified, as those of image_proc: their matrix is `p` of the topic
    /// `info`, and they have no distortion. Default: no.
    pub rectified: bool,
}

impl Default for Ros2CameraSettings {
    /// Returns the topics of realsense-ros, with the intrinsics that its node publishes.
    fn default() -> Self {
        Self {
            colour: "/camera/camera/color/image_raw".to_owned(),
            depth: "/camera/camera/aligned_depth_to_color/image_raw".to_owned(),
            info: "/camera/camera/color/camera_info".to_owned(),
            domain: None,
            interface: None,
            latency: None,
            intrinsics: IntrinsicsFrom::Device,
            rectified: false,
        }
    }
}

impl Ros2CameraSettings {
    /// Returns the topic of the depth pictures; `None` for a camera without depth.
    pub fn depth_topic(&self) -> Option<&str> {
        (self.depth != "none").then_some(self.depth.as_str())
    }
}
