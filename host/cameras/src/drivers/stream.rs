//! Frames from any program.

use crate::driver::{CameraDriver, DriverListing, OpenRequest, OpenedCamera};
use crate::settings::{SettingsError, SourceName};
use crate::source::BoxedError;
use crate::source::stream::{FIRST_FRAME, StreamSource};

/// Driver of frames that another program sends.
#[derive(Debug, Clone, Copy)]
pub struct StreamDriver;

impl CameraDriver for StreamDriver {
    fn name(&self) -> SourceName {
        SourceName::Stream
    }

    /// Lists nothing: the senders are unknown before they connect.
    fn list(&self) -> DriverListing {
        DriverListing::default()
    }

    fn open(&self, request: &OpenRequest<'_>) -> Result<OpenedCamera, BoxedError> {
        let address = request.settings.stream.as_ref().ok_or(SettingsError::NoStream)?;
        let source = StreamSource::open(address, &request.camera, FIRST_FRAME)?;
        let description = Some(format!("{address}, {}", source.format()));
        let intrinsics = source.format().intrinsics;
        let camera = OpenedCamera::start(source, request.camera.clone(), intrinsics)?;
        Ok(OpenedCamera { description, ..camera })
    }
}
