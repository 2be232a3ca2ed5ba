//! Registry of the camera drivers.
//!
//! A driver is a unit type that implements [`CameraDriver`], in a module of its own, and an entry
//! of [`DRIVERS`]. Its settings are a field of [`CameraSettings`].

mod openni;
mod realsense;
mod recording;
mod stream;
mod webcam;

use std::path::PathBuf;

use plumb_frame::camera::Camera;
use tracing::info;

use crate::camera_file;
use crate::driver::{CameraDriver, OpenError, OpenRequest, OpenedCamera};
use crate::settings::{CameraSettings, SourceName};

pub use openni::OpenniDriver;
pub use realsense::RealsenseDriver;
pub use recording::RecordingDriver;
pub use stream::StreamDriver;
pub use webcam::WebcamDriver;

/// All camera drivers of this crate. [`SourceName::Ros2`] has its driver in the crate `plumb-ros2`.
pub const DRIVERS: [&dyn CameraDriver; 5] =
    [&OpenniDriver, &RealsenseDriver, &RecordingDriver, &StreamDriver, &WebcamDriver];

/// Returns the driver of that name. [`SourceName::Simulated`] has none, and [`SourceName::Ros2`]
/// none in this crate.
pub fn driver(name: SourceName) -> Option<&'static dyn CameraDriver> {
    DRIVERS.into_iter().find(|driver| driver.name() == name)
}

/// Opens the camera or recording that `settings` choose and that the camera file describes as
/// `camera`. A camera that can record by itself also records to the file `device_recording`.
///
/// # Errors
/// Where the settings contradict themselves, or the driver cannot open the camera.
pub fn open_camera(
    settings: &CameraSettings,
    camera: Camera,
    device_recording: Option<PathBuf>,
) -> Result<OpenedCamera, OpenError> {
    open_camera_with(&[], settings, camera, device_recording)
}

/// Opens a camera as [`open_camera`]. The drivers `more` of other crates are tried after those of
/// this crate.
///
/// # Errors
/// As [`open_camera`].
pub fn open_camera_with(
    more: &[&dyn CameraDriver],
    settings: &CameraSettings,
    camera: Camera,
    device_recording: Option<PathBuf>,
) -> Result<OpenedCamera, OpenError> {
    let name = settings.source(false)?;
    let others = || more.iter().copied().find(|driver| driver.name() == name);
    let driver = driver(name).or_else(others).ok_or(OpenError::NoDriver(name))?;
    let request = OpenRequest { settings, camera, device_recording };
    let opened =
        driver.open(&request).map_err(|cause| OpenError::Driver { driver: name, cause })?;
    let intrinsics = &opened.camera.intrinsics;
    info!(driver = %name, device = opened.description, ?intrinsics, "opened the camera");
    Ok(opened)
}

impl CameraSettings {
    /// Opens the camera or recording that the settings choose and that their camera file describes.
    ///
    /// # Errors
    /// Where the camera file cannot be read or is invalid; as [`open_camera`].
    pub fn open(&self) -> Result<OpenedCamera, OpenError> {
        open_camera(self, camera_file::read(&self.file)?, None)
    }
}

#[cfg(test)]
mod tests {
    use std::error::Error;
    use std::path::Path;

    use super::*;
    use crate::source::OpenRecordingError;
    use crate::source::tum::TumError;
    use plumb_config::error_chain::ErrorChain;

    #[test]
    fn every_source_but_the_simulated_one_and_ros_has_one_driver() {
        let mut names: Vec<SourceName> = DRIVERS.iter().map(|driver| driver.name()).collect();
        names.extend([SourceName::Simulated, SourceName::Ros2]);
        let all = [
            SourceName::Openni,
            SourceName::Realsense,
            SourceName::Recording,
            SourceName::Stream,
            SourceName::Webcam,
            SourceName::Simulated,
            SourceName::Ros2,
        ];
        assert_eq!(names, all);
        assert!(driver(SourceName::Simulated).is_none() && driver(SourceName::Ros2).is_none());
    }

    #[test]
    fn a_recording_that_is_absent_is_an_error_with_its_cause() {
        let recording = Some(Path::new("no/such/folder").to_owned());
        let settings = CameraSettings { recording, ..CameraSettings::new("camera.toml") };
        let camera = camera_file::paper().unwrap();
        let Err(error) = open_camera(&settings, camera, None) else { panic!("opened") };
        let message = ErrorChain(&error).to_string();
        assert!(message.starts_with("camera driver `recording`: no/such/folder"), "{message}");
        let cause = error.source().and_then(|cause| cause.downcast_ref::<OpenRecordingError>());
        assert!(matches!(cause, Some(OpenRecordingError::Tum(TumError::Read(_)))), "{cause:?}");
    }

    #[test]
    fn the_simulated_rig_is_no_camera() {
        let simulated = Some(SourceName::Simulated);
        let settings = CameraSettings { source: simulated, ..CameraSettings::new("camera.toml") };
        let error = open_camera(&settings, camera_file::paper().unwrap(), None).err();
        assert!(matches!(error, Some(OpenError::Settings(_))), "{error:?}");
    }
}
