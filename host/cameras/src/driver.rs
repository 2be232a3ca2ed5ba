//! Interface of a camera driver.

use std::path::PathBuf;

use plumb_frame::camera::{Camera, Intrinsics};
use serde::Serialize;
use thiserror::Error;

use crate::settings::{CameraSettings, SettingsError, SourceName};
use crate::source::capture::{Capture, CaptureLimits, StartCaptureError};
use crate::source::{BoxedError, CameraSource};
use plumb_config::toml_file::TomlFileError;

/// Driver of a kind of camera. [`drivers`](crate::drivers) has the registry of all drivers.
pub trait CameraDriver: Sync {
    /// Returns the name of the driver: key `source` in the table `[camera]` of a rig file.
    fn name(&self) -> SourceName;

    /// Lists the cameras that can be opened now, and describes the library that drives them.
    fn list(&self) -> DriverListing;

    /// Opens the camera that the driver's table of `request.settings` describes, and starts it.
    ///
    /// # Errors
    /// Where the camera cannot be opened, or cannot do what its settings ask for.
    fn open(&self, request: &OpenRequest<'_>) -> Result<OpenedCamera, BoxedError>;
}

/// Camera to open.
#[derive(Debug, Clone)]
pub struct OpenRequest<'a> {
    /// Settings of all drivers. A driver reads its own table.
    pub settings: &'a CameraSettings,
    /// Contents of the camera file.
    pub camera: Camera,
    /// File for the device's own recording. A driver without one ignores it.
    pub device_recording: Option<PathBuf>,
}

/// Open camera or recording that delivers frames.
pub struct OpenedCamera {
    /// Source of the frames.
    pub source: Box<dyn CameraSource>,
    /// Camera file, with the intrinsics of the frames.
    pub camera: Camera,
    /// Name, address and mode of a device, for a person.
    pub description: Option<String>,
    /// Settings that the device does not support, and their consequences, for a person.
    pub notes: Vec<String>,
}

impl OpenedCamera {
    /// Starts to read `source`, whose frames have `intrinsics`, in a thread of its own. Returns a
    /// camera without description.
    ///
    /// # Errors
    /// As [`Capture::start`].
    pub fn start(
        source: impl CameraSource + Send + 'static,
        camera: Camera,
        intrinsics: Intrinsics,
    ) -> Result<Self, StartCaptureError> {
        let camera = Camera { intrinsics, ..camera };
        let source = Box::new(Capture::start(source, CaptureLimits::default())?);
        Ok(Self { source, camera, description: None, notes: Vec::new() })
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

/// Cameras of a driver, and its library.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DriverListing {
    /// The library of the driver, where it needs one.
    pub library: Option<LibraryStatus>,
    /// Cameras that can be opened now.
    pub cameras: Vec<FoundCamera>,
    /// What is missing to open other cameras, a sentence for each.
    pub missing: Vec<String>,
}

/// Status of a library that is loaded at run time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LibraryStatus {
    /// Name of the library.
    #[serde(skip)]
    pub name: &'static str,
    /// Whether it is loaded.
    #[serde(flatten)]
    pub state: LibraryState,
}

/// Whether a library is loaded.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LibraryState {
    /// The library is loaded.
    Loaded {
        /// Version, "2.2.0.33".
        version: String,
        /// File names of its drivers.
        drivers: Vec<String>,
    },
    /// The library cannot be loaded.
    Absent {
        /// Reason, and what to do.
        error: String,
    },
}

/// Camera that can be opened now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FoundCamera {
    /// Address of the camera: key `uri`, `serial` or `device` of the driver's table in a rig file.
    pub uri: String,
    /// Maker and model.
    pub name: String,
}
