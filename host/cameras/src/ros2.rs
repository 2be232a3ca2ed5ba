//! Table `[camera.ros2]` of a rig file. The driver is in the crate `plumb-ros2`.

use std::net::IpAddr;
use std::path::Path;

use plumb_config::quantity::{CameraTime, domain};
use plumb_frame::camera::Camera;
use plumb_frame::driver::{CameraDriver, IntrinsicsFrom, OpenedSource};
use plumb_frame::source::BoxedError;
use serde::{Deserialize, Deserializer, de};
use thiserror::Error;

/// Settings of a camera in ROS 2: table `[camera.ros2]` of a rig file. Every key may be left out.
/// The topics are by default those of realsense-ros with the camera's default name.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ros2CameraSettings {
    /// Topic of the colour pictures, `sensor_msgs/Image`; of `sensor_msgs/CompressedImage` where
    /// the name ends with `/compressed`. The slash at the beginning of a name may be left out.
    #[serde(deserialize_with = "topic")]
    pub colour: String,
    /// Topic of the depth pictures, aligned to colour; `"none"` for a camera without depth. Of
    /// `sensor_msgs/CompressedImage` where the name ends with `/compressedDepth` or `/compressed`.
    #[serde(deserialize_with = "topic")]
    pub depth: String,
    /// Topic of the camera's description, `sensor_msgs/CameraInfo`.
    #[serde(deserialize_with = "topic")]
    pub info: String,
    /// Domain of ROS 2, 0 to 232. Default: the variable `ROS_DOMAIN_ID`, else 0.
    #[serde(deserialize_with = "domain")]
    pub domain: Option<u16>,
    /// Address of the only network interface for ROS 2. Default: all of them, or 127.0.0.1 where
    /// ROS 2's variables ask for it.
    pub interface: Option<IpAddr>,
    /// Time from exposure to arrival of the fastest picture, seconds, above 0, to 10. Default:
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
        (self.depth != NO_DEPTH).then_some(self.depth.as_str())
    }

    /// Returns these settings with topics whose names begin with a slash.
    ///
    /// # Errors
    /// Where the name of a topic breaks the rules of ROS 2.
    pub fn with_absolute_topics(&self) -> Result<Self, TopicNameError> {
        let [colour, depth, info] = [&self.colour, &self.depth, &self.info].map(|it| absolute(it));
        Ok(Self { colour: colour?, depth: depth?, info: info?, ..self.clone() })
    }
}

/// A camera in ROS 2 that is to be opened by its settings alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "a camera in ROS 2 is opened with the driver of the crate plumb-ros2 \
     (plumb_cameras::open::open_with)"
)]
pub struct OtherCrate;

/// Opens nothing: the crate `plumb-ros2` has the driver.
impl CameraDriver for Ros2CameraSettings {
    fn open(&self, _: &Camera, _: Option<&Path>) -> Result<OpenedSource, BoxedError> {
        Err(OtherCrate.into())
    }
}

/// Value of the key `depth` for a camera without depth.
const NO_DEPTH: &str = "none";

/// Name of a topic that breaks the rules of ROS 2.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "`{0}` is no name of a topic of ROS 2: its parts, between slashes, begin with a letter and \
     have letters, digits and single underscores, as in /camera/color/image_raw; `ros2 topic \
     list` shows the names"
)]
pub struct TopicNameError(String);

/// Returns the name of a topic with the slash at its beginning, as ROS 2 takes the name in a node
/// without a namespace.
fn absolute(name: &str) -> Result<String, TopicNameError> {
    if name == NO_DEPTH {
        return Ok(name.to_owned());
    }
    let parts = name.strip_prefix('/').unwrap_or(name);
    let is_name = |part: &str| {
        part.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
            && part.chars().all(|it| it.is_ascii_alphanumeric() || it == '_')
            && !part.contains("__")
    };
    if parts.split('/').all(is_name) {
        Ok(format!("/{parts}"))
    } else {
        Err(TopicNameError(name.to_owned()))
    }
}

/// Reads the name of a topic.
fn topic<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    absolute(&String::deserialize(deserializer)?).map_err(de::Error::custom)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(text: &str) -> Result<Ros2CameraSettings, String> {
        toml::from_str(text).map_err(|error| error.to_string())
    }

    #[test]
    fn a_name_without_its_slash_is_taken_as_in_the_root() {
        let text = "colour = \"camera/color/image_raw\"\ndepth = \"none\"\ninfo = \"/info\"";
        let read = settings(text).unwrap();
        assert_eq!(read.colour, "/camera/color/image_raw");
        assert_eq!((read.depth_topic(), read.info.as_str()), (None, "/info"));
        let relative = Ros2CameraSettings { info: "a/_b2".to_owned(), ..read };
        assert_eq!(relative.with_absolute_topics().unwrap().info, "/a/_b2");
    }

    #[test]
    fn names_that_ros_refuses_are_refused() {
        for name in ["", "/", "~/image", "{node}/image", "a//b", "a/", "2nd", "a-b", "a__b", "a b"]
        {
            let error = settings(&format!("depth = \"{name}\"")).unwrap_err();
            let part = format!("`{name}` is no name of a topic of ROS 2");
            assert!(error.contains(&part) && error.contains("ros2 topic list"), "{error}");
            let made = Ros2CameraSettings { colour: name.to_owned(), ..Default::default() };
            assert!(made.with_absolute_topics().is_err(), "{name}");
        }
    }
}
