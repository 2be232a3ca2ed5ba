//! Opening of the camera or recording that the settings choose. A thread of its own reads it.

use std::path::Path;

use plumb_config::toml_file::TomlFileError;
use plumb_frame::camera::Camera;
use plumb_frame::driver::{CameraDriver, OpenedSource};
use plumb_frame::source::{BoxedError, CameraSource};
use thiserror::Error;
use tracing::info;

use crate::camera_file;
use crate::capture::{Capture, CaptureLimits, StartCaptureError};
use crate::settings::{CameraSettings, SettingsError, SourceName};

/// Open camera or recording, read in a thread of its own.
pub struct OpenedCamera {
    /// Source of the frames.
    pub source: Box<dyn CameraSource>,
    /// Camera file, with the intrinsics of the frames.
    pub camera: Camera,
    /// Name, address and mode of a device, for a person.
    pub description: Option<String>,
    /// Settings that the device does not support and contents of a recording that are not used,
    /// with their consequences, for a person.
    pub notes: Vec<String>,
}

impl OpenedCamera {
    /// Starts to read a source of frames that the camera file describes as `camera`.
    ///
    /// # Errors
    /// As [`Capture::start`].
    pub fn start(opened: OpenedSource, camera: Camera) -> Result<Self, StartCaptureError> {
        let OpenedSource { source, intrinsics, description, notes } = opened;
        let camera = Camera { intrinsics, ..camera };
        let source = Box::new(Capture::start(source, CaptureLimits::default())?);
        Ok(Self { source, camera, description, notes })
    }
}

/// Failure to open a camera.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The table `[camera]` contradicts itself.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The camera file cannot be read, or is invalid.
    #[error(transparent)]
    CameraFile(#[from] TomlFileError),
    /// No driver delivers the frames of this source.
    #[error("no camera driver has the name `{0}`")]
    NoDriver(SourceName),
    /// The driver cannot open the camera.
    #[error("camera driver `{driver}`")]
    Driver {
        /// Name of the driver.
        driver: SourceName,
        /// Error of the driver.
        #[source]
        cause: BoxedError,
    },
}

/// Opens the camera or recording that `settings` choose and that the camera file describes as
/// `camera`. A camera that can record by itself also records to the file `device_recording`.
///
/// # Errors
/// Where the settings contradict themselves, or the driver cannot open the camera.
pub fn open_camera(
    settings: &CameraSettings,
    camera: Camera,
    device_recording: Option<&Path>,
) -> Result<OpenedCamera, OpenError> {
    let name = settings.source(false)?;
    let driver = settings.driver(name).ok_or(OpenError::NoDriver(name))?;
    open_with(name, &*driver, camera, device_recording)
}

/// Opens a camera as [`open_camera`], with the driver `driver` of the source `name`.
///
/// # Errors
/// Where the driver cannot open the camera.
pub fn open_with(
    name: SourceName,
    driver: &dyn CameraDriver,
    camera: Camera,
    device_recording: Option<&Path>,
) -> Result<OpenedCamera, OpenError> {
    let failed = |cause| OpenError::Driver { driver: name, cause };
    let opened = driver.open(&camera, device_recording).map_err(failed)?;
    let opened = OpenedCamera::start(opened, camera).map_err(|error| failed(error.into()))?;
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
    use crate::recording::OpenRecordingError;
    use plumb_config::error_chain::ErrorChain;

    #[test]
    fn every_source_but_the_simulated_one_has_a_driver() {
        let (recording, stream) = (Some("a.oni".into()), Some("-".parse().unwrap()));
        let settings = CameraSettings { recording, stream, ..CameraSettings::new("camera.toml") };
        for &name in SourceName::ALL {
            let has_driver = settings.driver(name).is_some();
            assert_eq!(has_driver, name != SourceName::Simulated, "{name}");
        }
    }

    #[test]
    fn a_recording_that_is_absent_is_an_error_with_its_cause() {
        let recording = Some(Path::new("no/such/folder").to_owned());
        let settings = CameraSettings { recording, ..CameraSettings::new("camera.toml") };
        let camera = camera_file::paper().unwrap();
        let Err(error) = open_camera(&settings, camera, None) else { panic!("opened") };
        let message = ErrorChain(&error).to_string();
        let says = "camera driver `recording`: no/such/folder: there is no such recording";
        assert_eq!(message, says);
        let cause = error.source().and_then(|cause| cause.downcast_ref::<OpenRecordingError>());
        assert!(matches!(cause, Some(OpenRecordingError::Absent(_))), "{cause:?}");
    }

    #[test]
    fn the_simulated_rig_is_no_camera() {
        let simulated = Some(SourceName::Simulated);
        let settings = CameraSettings { source: simulated, ..CameraSettings::new("camera.toml") };
        let error = open_camera(&settings, camera_file::paper().unwrap(), None).err();
        assert!(matches!(error, Some(OpenError::Settings(_))), "{error:?}");
    }
}
