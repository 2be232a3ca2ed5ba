//! Opening a recording of any kind.

use std::path::Path;

use plumb_vision::camera::Intrinsics;

use super::openni::{Lens, OpenNi, OpenniSource, Settings, Target};
use super::tum::TumFolder;
use super::{Source, SourceError};

/// A recording that is open.
pub struct OpenedRecording {
    /// Gives its frames.
    pub source: Box<dyn Source>,
    /// The intrinsics of its frames.
    pub intrinsics: Intrinsics,
}

/// Opens the recording at `path`: an `.oni` file where it is a file, else a TUM folder.
/// `intrinsics` are those of the camera file; of an `.oni` file the scale of depth is its own.
///
/// # Errors
/// As [`TumFolder::open`] and [`OpenniSource::open`]; where an `.oni` file is to be read and
/// OpenNI2 cannot be loaded.
pub fn open_recording(path: &Path, intrinsics: Intrinsics) -> Result<OpenedRecording, SourceError> {
    if !path.is_file() {
        return Ok(OpenedRecording {
            source: Box::new(TumFolder::open(path, intrinsics)?),
            intrinsics,
        });
    }
    let openni = OpenNi::load()?;
    let (target, lens) = (Target::Recording(path.to_owned()), Lens::Calibrated(intrinsics));
    let source = OpenniSource::open(&openni, &target, Settings::default(), lens)?;
    let intrinsics = *source.intrinsics();
    Ok(OpenedRecording { source: Box::new(source), intrinsics })
}
