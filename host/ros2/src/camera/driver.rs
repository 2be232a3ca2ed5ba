//! Driver of the cameras in ROS 2.

use std::path::Path;

use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_frame::camera::Camera;
use plumb_frame::driver::{CameraDriver, OpenedSource};
use plumb_frame::source::BoxedError;

use super::source::{FIRST_PICTURE, Ros2Camera};
use crate::network::Network;

/// Driver of cameras that another node publishes in ROS 2. The nodes are unknown before they are
/// heard: none is listed.
#[derive(Debug, Clone, Copy)]
pub struct Ros2Driver<'a>(pub &'a Ros2CameraSettings);

impl CameraDriver for Ros2Driver<'_> {
    fn open(&self, camera: &Camera, _: Option<&Path>) -> Result<OpenedSource, BoxedError> {
        let network = Network::choose(self.0.domain, self.0.interface)?;
        let source = Ros2Camera::open(self.0, &network, camera, FIRST_PICTURE)?;
        let (description, intrinsics) = (Some(source.description()), source.intrinsics());
        Ok(OpenedSource { description, ..OpenedSource::new(source, intrinsics) })
    }
}
