//! Opening a recording of any format.

use std::path::Path;

use plumb_frame::camera::Intrinsics;
use thiserror::Error;

use super::camera_source::CameraSource;
use super::openni::{IntrinsicsSource, OpenNi, OpenniSource, OpenniSourceError, Settings, Target};
use super::realsense::{self, RealSense, RealsenseSource, RealsenseSourceError};
use super::resolution::FileIntrinsics;
use super::tum::{TumError, TumFolder};
use super::webcam::VIDEO_ENDINGS;

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
    /// A `.bag` or `.db3` file cannot be opened.
    #[error(transparent)]
    Realsense(#[from] RealsenseSourceError),
    /// A video file cannot be opened.
    #[cfg(feature = "webcam")]
    #[error(transparent)]
    Video(#[from] super::webcam::WebcamSourceError),
    /// The program is built without video files.
    #[cfg(not(feature = "webcam"))]
    #[error("{}", .path.display())]
    NoVideo {
        /// The video file.
        path: std::path::PathBuf,
        /// What to do.
        source: super::webcam::NotBuilt,
    },
}

/// Opens the recording at `path`, to be read as fast as the caller takes frames: a `.bag` or `.db3`
/// file of librealsense2, a video file, an `.oni` file where `path` is another file, else a TUM
/// folder. `intrinsics` are those of the camera file; an `.oni` file states its depth scale itself,
/// a file of librealsense2 its intrinsics too. A video file has no depth.
///
/// # Errors
/// As [`TumFolder::open`], [`OpenniSource::open`] and [`RealsenseSource::open`]; where `path` is a
/// file and its library cannot be loaded; where it is a video file and the program is built without
/// them.
pub fn open_recording(
    path: &Path,
    intrinsics: impl Into<FileIntrinsics>,
) -> Result<OpenedRecording, OpenRecordingError> {
    let intrinsics = intrinsics.into();
    if !path.is_file() {
        let source = TumFolder::open(path, intrinsics)?;
        let intrinsics = *source.intrinsics();
        return Ok(OpenedRecording { source: Box::new(source), intrinsics });
    }
    if path.extension().is_some_and(|kind| kind == "bag" || kind == "db3") {
        return open_realsense(path);
    }
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    if ending.is_some_and(|ending| VIDEO_ENDINGS.contains(&ending.as_str())) {
        return open_video(path, intrinsics);
    }
    let openni = OpenNi::load().map_err(OpenniSourceError::from)?;
    let target = Target::Recording(path.to_owned());
    let intrinsics = IntrinsicsSource::Calibrated(intrinsics);
    let source = OpenniSource::open(&openni, &target, Settings::default(), intrinsics)?;
    let intrinsics = *source.intrinsics();
    Ok(OpenedRecording { source: Box::new(source), intrinsics })
}

/// Opens a video file.
#[cfg(feature = "webcam")]
fn open_video(
    path: &Path,
    intrinsics: FileIntrinsics,
) -> Result<OpenedRecording, OpenRecordingError> {
    let source = super::webcam::VideoFileSource::open(path, intrinsics)?;
    let intrinsics = *source.intrinsics();
    Ok(OpenedRecording { source: Box::new(source), intrinsics })
}

/// Returns the error of a program without video files.
#[cfg(not(feature = "webcam"))]
fn open_video(path: &Path, _: FileIntrinsics) -> Result<OpenedRecording, OpenRecordingError> {
    let source = super::webcam::NotBuilt;
    Err(OpenRecordingError::NoVideo { path: path.to_owned(), source })
}

/// Opens a recording of librealsense2.
fn open_realsense(path: &Path) -> Result<OpenedRecording, OpenRecordingError> {
    let library = RealSense::load().map_err(RealsenseSourceError::from)?;
    let target = realsense::Target::Recording(path.to_owned());
    let settings = realsense::Settings::default();
    let source = RealsenseSource::open(&library, &target, settings, None)?;
    let intrinsics = *source.intrinsics();
    Ok(OpenedRecording { source: Box::new(source), intrinsics })
}
