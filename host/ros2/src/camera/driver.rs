//! Driver of the cameras in ROS 2.

use plumb_cameras::driver::{CameraDriver, DriverListing, OpenRequest, OpenedCamera};
use plumb_cameras::settings::SourceName;
use plumb_cameras::source::BoxedError;

use super::source::{FIRST_PICTURE, Ros2Camera};
use crate::network::Network;

/// Driver of cameras that another node publishes in ROS 2.
#[derive(Debug, Clone, Copy)]
pub struct Ros2Driver;

impl CameraDriver for Ros2Driver {
    fn name(&self) -> SourceName {
        SourceName::Ros2
    }

    /// Lists nothing: the nodes are unknown before they are heard.
    fn list(&self) -> DriverListing {
        DriverListing::default()
    }

    fn open(&self, request: &OpenRequest<'_>) -> Result<OpenedCamera, BoxedError> {
        let settings = &request.settings.ros2;
        let network = Network::choose(settings.domain, settings.interface)?;
        let source = Ros2Camera::open(settings, &network, &request.camera, FIRST_PICTURE)?;
        let (description, intrinsics) = (Some(source.description()), source.intrinsics());
        let camera = OpenedCamera::start(source, request.camera.clone(), intrinsics)?;
        Ok(OpenedCamera { description, ..camera })
    }
}
