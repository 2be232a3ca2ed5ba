//! The node of a run.

use std::path::Path;
use std::str::ParseBoolError;

use plumb_cameras::open::{OpenedCamera, open_with};
use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_cameras::settings::{CameraSettings, SourceName};
use plumb_frame::driver::OpenedSource;
use plumb_ros2::{McapRecording, Namespace, Network, Ros2Driver, Ros2Settings};

pub(crate) use plumb_ros2::Ros2Output;
use plumb_runtime::operator::OperatorSender;
use plumb_vision::camera::Camera;

use super::Ros2Options;
use crate::cli::exit::Failure;

/// Reads the option `--ros2`.
pub(crate) fn flag(text: &str) -> Result<bool, ParseBoolError> {
    text.parse()
}

/// Opens the camera in ROS 2 that `settings` choose.
pub(super) fn open_node(
    settings: &CameraSettings,
    camera: Camera,
    device_recording: Option<&Path>,
) -> Result<OpenedCamera, Failure> {
    let driver = Ros2Driver(&settings.ros2);
    Ok(open_with(SourceName::Ros2, &driver, camera, device_recording)?)
}

/// Opens an MCAP file. `settings` may name its topics.
pub(super) fn open_mcap(
    path: &Path,
    camera: &Camera,
    settings: &Ros2CameraSettings,
) -> Result<OpenedSource, Failure> {
    let source = McapRecording::open(path, camera, settings)?;
    let intrinsics = *source.intrinsics();
    Ok(OpenedSource::new(source, intrinsics))
}

impl Ros2Options {
    /// Joins ROS 2 with a node that sends its commands to `operator`; `None` where no option asks
    /// for it.
    ///
    /// # Errors
    /// Where the domain or the interface does not exist.
    pub(crate) fn start(
        &self,
        camera: &Camera,
        operator: &OperatorSender,
    ) -> Result<Option<Ros2Output>, Failure> {
        if !self.ros2 {
            return Ok(None);
        }
        let namespace: Namespace = self.ros2_namespace.parse()?;
        let network = Network::choose(self.ros2_domain, self.ros2_interface)?;
        let settings = Ros2Settings { namespace: namespace.clone(), network, camera: camera.pose };
        let output = Ros2Output::start(&settings, operator.clone())?;
        let unread = Network::unread_variables();
        if !unread.is_empty() {
            tell!(
                "plumb: ROS 2: this node does not read {}: `ros2 service list` must show \
                 {namespace}/stop, or no stop arrives",
                unread.join(", ")
            );
        }
        note!(
            "ROS 2: {namespace} in domain {} (the run goes on until Ctrl-C); stop: \
             ros2 service call {}/stop std_srvs/srv/Trigger",
            network.domain,
            namespace
        );
        Ok(Some(output))
    }
}
