//! A program without ROS 2.

use std::path::Path;

use plumb_cameras::open::{self, OpenedCamera};
use plumb_cameras::recording::{self, is_mcap};
use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_cameras::settings::{CameraSettings, SourceName};
use plumb_frame::clock::LiveClock;
use plumb_frame::driver::OpenedSource;
use plumb_runtime::observer::Observer;
use plumb_runtime::operator::OperatorSender;
use plumb_vision::camera::Camera;

use super::Ros2Options;
use crate::cli::exit::{Failure, failed};

/// Reason to refuse a use of ROS 2.
const ABSENT: &str = "this program was built without ROS 2; build it with \
                      cargo build --release -p plumb --features ros2";

/// Refuses the option `--ros2`.
pub(crate) fn flag(text: &str) -> Result<bool, &'static str> {
    if text == "false" { Ok(false) } else { Err(ABSENT) }
}

/// Opens the camera that `settings` choose.
///
/// # Errors
/// Where it is a camera in ROS 2 or an MCAP file.
pub(crate) fn open_camera(
    settings: &CameraSettings,
    camera: Camera,
    device_recording: Option<&Path>,
) -> Result<OpenedCamera, Failure> {
    if settings.source == Some(SourceName::Ros2) {
        return Err(failed(ABSENT));
    }
    if let Some(path) = settings.recording.as_ref().filter(|path| is_mcap(path)) {
        return Err(without_mcap(path));
    }
    Ok(open::open_camera(settings, camera, device_recording)?)
}

/// Opens a recording.
///
/// # Errors
/// Where it is an MCAP file.
pub(crate) fn open_recording(
    path: &Path,
    camera: &Camera,
    _: &Ros2CameraSettings,
) -> Result<OpenedSource, Failure> {
    if is_mcap(path) {
        return Err(without_mcap(path));
    }
    Ok(recording::open_recording(path, camera)?)
}

fn without_mcap(path: &Path) -> Failure {
    failed(format!("{}: an MCAP recording: {ABSENT}", path.display()))
}

/// Node without effect.
pub(crate) struct Ros2;

impl Ros2Options {
    /// Starts nothing: the option was refused.
    pub(crate) fn start(&self, _: &Camera, _: &OperatorSender) -> Result<Ros2, Failure> {
        Ok(Ros2)
    }
}

impl Ros2 {
    /// Does nothing.
    pub(crate) fn set_clock(&self, _: Option<LiveClock>) {}

    /// Returns no observer.
    pub(crate) fn observer(&mut self) -> Option<&mut dyn Observer> {
        None
    }
}
