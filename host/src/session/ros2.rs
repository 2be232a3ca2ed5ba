//! A run in ROS 2: its options.

#[cfg_attr(feature = "ros2", path = "ros2/present.rs")]
#[cfg_attr(not(feature = "ros2"), path = "ros2/absent.rs")]
mod output;

use std::net::IpAddr;
use std::path::Path;

use clap::Args;
use plumb_cameras::open::{self, OpenedCamera};
use plumb_cameras::recording::{self, is_mcap, played};
use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_cameras::settings::{CameraSettings, SourceName};
use plumb_frame::driver::OpenedSource;
use plumb_vision::camera::Camera;

use crate::cli::exit::Failure;
use crate::cli::numbers;

pub(crate) use output::Ros2Output;

#[derive(Args)]
pub(crate) struct Ros2Options {
    /// Join ROS 2: publish the ball, tf and diagnostics, take targets and a stop; the run goes on
    /// until Ctrl-C. Every computer in the domain that reaches this one can move the rig
    #[arg(long, value_parser = output::flag)]
    pub(crate) ros2: bool,
    /// Namespace of the node, its topics and services
    #[arg(long, value_name = "NAMESPACE", requires = "ros2", default_value = "/plumb")]
    pub(crate) ros2_namespace: String,
    /// Domain of ROS 2, 0 to 232 [default: ROS_DOMAIN_ID, or 0]
    #[arg(long, value_name = "DOMAIN", requires = "ros2", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u16>(0.0, 232.0, ""))]
    pub(crate) ros2_domain: Option<u16>,
    /// Address of the only network interface for ROS 2; 127.0.0.1 for this computer only [default:
    /// all; 127.0.0.1 with ROS_LOCALHOST_ONLY=1 or ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST]
    #[arg(long, value_name = "ADDRESS", requires = "ros2")]
    pub(crate) ros2_interface: Option<IpAddr>,
}

/// Opens the camera that `settings` choose, also one in ROS 2.
pub(crate) fn open_camera(
    settings: &CameraSettings,
    camera: Camera,
    device_recording: Option<&Path>,
) -> Result<OpenedCamera, Failure> {
    if let Some(path) = settings.recording.as_ref().filter(|path| is_mcap(path)) {
        settings.source(false)?;
        let recording = output::open_mcap(path, &camera, &settings.ros2)?;
        return Ok(OpenedCamera::start(played(recording), camera)?);
    }
    if settings.source(false)? == SourceName::Ros2 {
        return output::open_node(settings, camera, device_recording);
    }
    Ok(open::open_camera(settings, camera, device_recording)?)
}

/// Opens a recording of any format. `settings` may name the topics of an MCAP file.
pub(crate) fn open_recording(
    path: &Path,
    camera: &Camera,
    settings: &Ros2CameraSettings,
) -> Result<OpenedSource, Failure> {
    match is_mcap(path) {
        true => output::open_mcap(path, camera, settings),
        false => Ok(recording::open_recording(path, camera)?),
    }
}
