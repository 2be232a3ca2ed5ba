//! A program without ROS 2.

use std::path::Path;

use plumb_cameras::open::OpenedCamera;
use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_cameras::settings::CameraSettings;
use plumb_frame::clock::LiveClock;
use plumb_frame::driver::OpenedSource;
use plumb_runtime::observer::{FrameRecord, Observer};
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

/// Refuses a camera in ROS 2.
pub(super) fn open_node(
    _: &CameraSettings,
    _: Camera,
    _: Option<&Path>,
) -> Result<OpenedCamera, Failure> {
    Err(failed(ABSENT))
}

/// Refuses an MCAP file.
pub(super) fn open_mcap(
    path: &Path,
    _: &Camera,
    _: &Ros2CameraSettings,
) -> Result<OpenedSource, Failure> {
    Err(failed(format!("{}: an MCAP recording: {ABSENT}", path.display())))
}

/// Node that no program of this kind has.
pub(crate) enum Ros2Output {}

impl Ros2Options {
    /// Starts nothing: the option was refused.
    pub(crate) fn start(
        &self,
        _: &Camera,
        _: &OperatorSender,
    ) -> Result<Option<Ros2Output>, Failure> {
        Ok(None)
    }
}

impl Ros2Output {
    pub(crate) fn set_clock(&self, _: LiveClock) {}
}

impl Observer for Ros2Output {
    fn frame(&mut self, _: &FrameRecord) {}
}
