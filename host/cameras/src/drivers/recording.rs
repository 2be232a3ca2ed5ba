//! Recordings in the place of a camera.

use crate::driver::{CameraDriver, DriverListing, OpenRequest, OpenedCamera};
use crate::settings::{SettingsError, SourceName};
use crate::source::playback::Playback;
use crate::source::{BoxedError, OpenedRecording, open_recording};

/// Driver that plays a recording at the speed at which it was recorded.
#[derive(Debug, Clone, Copy)]
pub struct RecordingDriver;

impl CameraDriver for RecordingDriver {
    fn name(&self) -> SourceName {
        SourceName::Recording
    }

    /// Returns an empty list: recordings are not searched for.
    fn list(&self) -> DriverListing {
        DriverListing::default()
    }

    fn open(&self, request: &OpenRequest<'_>) -> Result<OpenedCamera, BoxedError> {
        let path = request.settings.recording.as_ref().ok_or(SettingsError::NoRecording)?;
        let OpenedRecording { source, intrinsics, notes } = open_recording(path, &request.camera)?;
        let camera = request.camera.clone();
        Ok(OpenedCamera {
            notes,
            ..OpenedCamera::start(Playback::new(source), camera, intrinsics)?
        })
    }
}
