//! Opening a recording of either format.

use std::path::Path;

use plumb_frame::camera::Intrinsics;
use thiserror::Error;

use super::camera_source::CameraSource;
use super::openni::{IntrinsicsSource, OpenNi, OpenniSource, OpenniSourceError, Settings, Target};
use super::tum::{TumError, TumFolder};

/// Open recording.
pub struct OpenedRecording {
    /// Source of its frames.
    pub source: Box<dyn CameraSource + Send>,
    /// Intrinsics of its frames.
    pub intrinsics: Intrinsics,
}

/// Failure to open a recording.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OpenRecordingError {
    /// A TUM folder cannot be opened.
    #[error(transparent)]
    Tum(#[from] TumError),
    /// An `.oni` file cannot be opened.
    #[error(transparent)]
    Openni(#[from] OpenniSourceError),
}

/// Opens the recording at `path`, to be read as fast as the caller takes frames: an `.oni` file
/// where `path` is a file, else a TUM folder. `intrinsics` are those of the camera file; an `.oni`
/// file states its depth scale itself.
///
/// # Errors
/// As [`TumFolder::open`] and [`OpenniSource::open`]; where `path` is an `.oni` file and OpenNI2
/// cannot be loaded.
pub fn open_recording(
    path: &Path,
    intrinsics: Intrinsics,
) -> Result<OpenedRecording, OpenRecordingError> {
    if !path.is_file() {
        let source = Box::new(TumFolder::open(path, intrinsics)?);
        return Ok(OpenedRecording { source, intrinsics });
    }
    let openni = OpenNi::load().map_err(OpenniSourceError::from)?;
    let target = Target::Recording(path.to_owned());
    let intrinsics = IntrinsicsSource::Calibrated(intrinsics);
    let source = OpenniSource::open(&openni, &target, Settings::default(), intrinsics)?;
    let intrinsics = *source.intrinsics();
    Ok(OpenedRecording { source: Box::new(source), intrinsics })
}
