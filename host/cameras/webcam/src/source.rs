//! Webcams and video files as sources of frames without depth.

use std::path::Path;
use std::time::Instant;

use plumb_frame::camera::Intrinsics;
use plumb_frame::clock::LiveClock;
use plumb_frame::file_intrinsics::{FileIntrinsics, UnfitIntrinsics};
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::{Image, ImageError, ImageSize};
use plumb_frame::source::{CameraSource, InvalidFrame, SourceError};
use thiserror::Error;

use crate::error::WebcamError;
use crate::picture::Picture;
use crate::settings::{Mode, Settings};
use crate::video_file::VideoFile;
use crate::webcam::Webcam;

/// Failure to open a webcam or a video file, or to read it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WebcamSourceError {
    /// The device or the file fails.
    #[error(transparent)]
    Webcam(#[from] WebcamError),
    /// The intrinsics do not fit the pictures.
    #[error(transparent)]
    UnfitIntrinsics(#[from] UnfitIntrinsics),
    /// A picture has another number of pixels than its size.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// Webcam. Its frames have no depth; their time stamps are seconds since it was opened.
#[derive(Debug)]
pub struct WebcamSource {
    webcam: Webcam,
    intrinsics: Intrinsics,
    clock: LiveClock,
}

/// Video file. Its frames have no depth; their time stamps are seconds since the first one.
#[derive(Debug)]
pub struct VideoFileSource {
    file: VideoFile,
    /// Path of the file.
    origin: String,
    intrinsics: Intrinsics,
    now: f64,
}

impl WebcamSource {
    /// Opens a webcam, whose frames have `intrinsics` without depth.
    ///
    /// # Errors
    /// As [`Webcam::open`]; where the intrinsics do not fit the pictures.
    pub fn open(
        settings: &Settings,
        intrinsics: impl Into<FileIntrinsics>,
    ) -> Result<Self, WebcamSourceError> {
        let webcam = Webcam::open(settings)?;
        let intrinsics = checked(intrinsics.into(), webcam.mode(), webcam.path())?;
        Ok(Self { webcam, intrinsics, clock: LiveClock::since(Instant::now()) })
    }

    /// Returns the camera.
    pub fn webcam(&self) -> &Webcam {
        &self.webcam
    }

    /// Returns the intrinsics of the frames.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }
}

impl VideoFileSource {
    /// Opens the video file at `path`, whose frames have `intrinsics` without depth.
    ///
    /// # Errors
    /// As [`VideoFile::open`]; where the intrinsics do not fit the pictures.
    pub fn open(
        path: &Path,
        intrinsics: impl Into<FileIntrinsics>,
    ) -> Result<Self, WebcamSourceError> {
        let file = VideoFile::open(path)?;
        let intrinsics = checked(intrinsics.into(), file.mode(), path)?;
        Ok(Self { file, origin: path.display().to_string(), intrinsics, now: 0.0 })
    }

    /// Returns what the file has and is not used, for a person ([`VideoFile::notes`]).
    pub fn notes(&self) -> &[String] {
        self.file.notes()
    }

    /// Returns the intrinsics of the frames.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }
}

impl CameraSource for WebcamSource {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let clock = &self.clock;
        let picture = self.webcam.next_picture(|| clock.now()).map_err(lost)?;
        frame(picture, self.intrinsics, &self.webcam.path().display()).map(Some)
    }

    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn clock(&self) -> Option<LiveClock> {
        Some(self.clock.clone())
    }
}

impl CameraSource for VideoFileSource {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let Some(picture) = self.file.next_picture().map_err(lost)? else { return Ok(None) };
        self.now = picture.time;
        frame(picture, self.intrinsics, &self.origin).map(Some)
    }

    /// Returns the time stamp of the last frame, seconds; 0 before the first one.
    fn now(&self) -> f64 {
        self.now
    }
}

/// Returns `intrinsics` without depth, if they fit the pictures at `path`.
fn checked(
    intrinsics: FileIntrinsics,
    mode: Mode,
    path: &Path,
) -> Result<Intrinsics, UnfitIntrinsics> {
    let size = ImageSize { width: mode.width, height: mode.height };
    let intrinsics = intrinsics.of_pictures(size, path.display())?;
    Ok(Intrinsics { depth_scale: 0.0, ..intrinsics })
}

/// Makes a frame without depth of a picture.
fn frame(
    picture: Picture,
    intrinsics: Intrinsics,
    origin: &impl ToString,
) -> Result<RgbdFrame, SourceError> {
    let Picture { time, width, height, bgr } = picture;
    let colour = Image::new(width, height, bgr).map_err(WebcamSourceError::from)?;
    let frame = RgbdFrame::new(time, colour, Image::filled(width, height, 0), intrinsics);
    Ok(frame.map_err(InvalidFrame::of(&origin.to_string()))?)
}

/// Converts an error of the camera or the file. A picture that is damaged, of another size or
/// without a time is lost alone.
fn lost(error: WebcamError) -> SourceError {
    let is_transient = matches!(
        error,
        WebcamError::Damaged { .. } | WebcamError::OtherSize { .. } | WebcamError::NoTime { .. }
    );
    SourceError::lost(WebcamSourceError::from(error), is_transient)
}

impl From<WebcamSourceError> for SourceError {
    fn from(error: WebcamSourceError) -> Self {
        Self::new(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damaged_picture_is_lost_alone_and_an_unplugged_camera_is_over() {
        let path = || Path::new("/dev/video0").to_owned();
        let damaged = lost(WebcamError::Damaged { path: path(), source: None });
        assert!(!damaged.is_over());
        assert!(lost(WebcamError::Lost { path: path() }).is_over());
    }
}
