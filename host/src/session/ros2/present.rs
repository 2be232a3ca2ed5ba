//! The node of a run.

use std::path::Path;
use std::str::ParseBoolError;

use plumb_cameras::open::{self, OpenedCamera, open_with};
use plumb_cameras::recording::{self, is_mcap, played};
use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_cameras::settings::{CameraSettings, SourceName};
use plumb_frame::clock::LiveClock;
use plumb_frame::driver::OpenedSource;
use plumb_ros2::{McapRecording, Namespace, Network, Ros2Driver, Ros2Output, Ros2Settings};
use plumb_runtime::observer::Observer;
use plumb_runtime::operator::OperatorSender;
use plumb_vision::camera::Camera;

use super::Ros2Options;
use crate::cli::exit::Failure;
use crate::cli::print::{note, tell};

/// Reads the option `--ros2`.
pub(crate) fn flag(text: &str) -> Result<bool, ParseBoolError> {
    text.parse()
}

/// Opens the camera that `settings` choose, also one in ROS 2.
pub(crate) fn open_camera(
    settings: &CameraSettings,
    camera: Camera,
    device_recording: Option<&Path>,
) -> Result<OpenedCamera, Failure> {
    if let Some(path) = settings.recording.as_ref().filter(|path| is_mcap(path)) {
        settings.source(false)?;
        let recording = open_recording(path, &camera, &settings.ros2)?;
        return Ok(OpenedCamera::start(played(recording), camera)?);
    }
    if settings.source(false)? == SourceName::Ros2 {
        let driver = Ros2Driver(&settings.ros2);
        return Ok(open_with(SourceName::Ros2, &driver, camera, device_recording)?);
    }
    Ok(open::open_camera(settings, camera, device_recording)?)
}

/// Opens a recording of any format. `settings` may name the topics of an MCAP file.
pub(crate) fn open_recording(
    path: &Path,
    camera: &Camera,
    settings: &Ros2CameraSettings,
) -> Result<OpenedSource, Failure> {
    if !is_mcap(path) {
        return Ok(recording::open_recording(path, camera)?);
    }
    let source = McapRecording::open(path, camera, settings)?;
    let intrinsics = *source.intrinsics();
    Ok(OpenedSource::new(source, intrinsics))
}

/// Node of a run; without effect where no option asks for one.
pub(crate) struct Ros2(Option<Ros2Output>);

impl Ros2Options {
    /// Joins ROS 2 with a node that sends its commands to `operator`, where the options ask for it.
    ///
    /// # Errors
    /// Where the domain or the interface does not exist.
    pub(crate) fn start(
        &self,
        camera: &Camera,
        operator: &OperatorSender,
    ) -> Result<Ros2, Failure> {
        if !self.ros2 {
            return Ok(Ros2(None));
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
        Ok(Ros2(Some(output)))
    }
}

impl Ros2 {
    /// Sets the clock that stamps the run's frames; `None` where it stands.
    pub(crate) fn set_clock(&self, clock: Option<LiveClock>) {
        if let (Some(output), Some(clock)) = (&self.0, clock) {
            output.set_clock(clock);
        }
    }

    /// Returns the observer, if there is a node.
    pub(crate) fn observer(&mut self) -> Option<&mut dyn Observer> {
        self.0.as_mut().map(|output| output as &mut dyn Observer)
    }
}
