//! Interface of a kind of camera: its settings list the cameras and open one as a source of frames.

use std::fmt::Display;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::camera::{Camera, Intrinsics};
use crate::source::{BoxedError, CameraSource};

/// Kind of camera, with its settings: the contents of a table such as `[camera.openni]` of a rig
/// file, or another way to name a source of frames. `plumb-cameras` has the registry of all kinds.
pub trait CameraDriver {
    /// Lists the cameras that can be opened now, and describes the library that drives them. The
    /// settings have no influence. By default there is nothing to list.
    fn list(&self) -> DriverListing {
        DriverListing::default()
    }

    /// Opens the camera that the settings describe, and starts it. `camera` is the contents of the
    /// camera file. The device also records to the file `recording`, if it can.
    ///
    /// # Errors
    /// Where the camera cannot be opened, or cannot do what its settings ask for.
    fn open(&self, camera: &Camera, recording: Option<&Path>) -> Result<OpenedSource, BoxedError>;
}

impl<D: CameraDriver + ?Sized> CameraDriver for &D {
    fn list(&self) -> DriverListing {
        (**self).list()
    }

    fn open(&self, camera: &Camera, recording: Option<&Path>) -> Result<OpenedSource, BoxedError> {
        (**self).open(camera, recording)
    }
}

/// Open camera or recording.
pub struct OpenedSource {
    /// Source of its frames.
    pub source: Box<dyn CameraSource + Send>,
    /// Intrinsics of its frames.
    pub intrinsics: Intrinsics,
    /// Name, address and mode of a device, for a person.
    pub description: Option<String>,
    /// Settings that the device does not support and contents of a recording that are not used,
    /// with their consequences, for a person.
    pub notes: Vec<String>,
}

impl OpenedSource {
    /// Returns a source whose frames have `intrinsics`, without description.
    pub fn new(source: impl CameraSource + Send + 'static, intrinsics: Intrinsics) -> Self {
        Self { source: Box::new(source), intrinsics, description: None, notes: Vec::new() }
    }
}

/// Origin of the intrinsics: key `intrinsics` of a camera's table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum IntrinsicsFrom {
    /// The camera file.
    #[default]
    File,
    /// The device.
    Device,
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

impl DriverListing {
    /// Returns the listing of a driver whose library `name` is loaded at run time: what the library
    /// lists, or why it cannot be loaded.
    pub fn of_library<E: Display>(
        name: &'static str,
        listed: Result<(LibraryState, Vec<FoundCamera>), E>,
    ) -> Self {
        let (state, cameras) = listed.unwrap_or_else(|error| {
            (LibraryState::Absent { error: error.to_string() }, Vec::new())
        });
        Self { library: Some(LibraryStatus { name, state }), cameras, ..Self::default() }
    }
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
