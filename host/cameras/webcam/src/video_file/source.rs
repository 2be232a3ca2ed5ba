//! Video files as sources of frames without depth.

use std::path::Path;

use plumb_frame::camera::Intrinsics;
use plumb_frame::file_intrinsics::FileIntrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::Image;
use plumb_frame::source::{CameraSource, InvalidFrame, SourceError};

use super::{Picture, VideoFile, VideoFileError};

/// Video file. Its frames have no depth; their time stamps are seconds since the first one.
#[derive(Debug)]
pub struct VideoFileSource {
    file: VideoFile,
    /// Path of the file.
    origin: String,
    intrinsics: Intrinsics,
    now: f64,
}

impl VideoFileSource {
    /// Opens the video file at `path`, whose frames have `intrinsics` without depth.
    ///
    /// # Errors
    /// As [`VideoFile::open`]; where the intrinsics do not fit the pictures.
    pub fn open(
        path: &Path,
        intrinsics: impl Into<FileIntrinsics>,
    ) -> Result<Self, VideoFileError> {
        let (file, origin) = (VideoFile::open(path)?, path.display().to_string());
        let intrinsics = intrinsics.into().of_pictures(file.mode().size, &origin)?;
        let intrinsics = Intrinsics { depth_scale: 0.0, ..intrinsics };
        Ok(Self { file, origin, intrinsics, now: 0.0 })
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

impl CameraSource for VideoFileSource {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        // A picture of another size or without a time is lost alone.
        let picture = self.file.next_picture().map_err(|error| {
            let is_over = matches!(error, VideoFileError::Library { .. });
            SourceError::lost(error, !is_over)
        });
        let Some(Picture { time, colour }) = picture? else { return Ok(None) };
        self.now = time;
        let depth = Image::filled(colour.width(), colour.height(), 0);
        let frame = RgbdFrame::new(time, colour, depth, self.intrinsics);
        Ok(Some(frame.map_err(InvalidFrame::of(&self.origin))?))
    }

    /// Returns the time stamp of the last frame, seconds; 0 before the first one.
    fn now(&self) -> f64 {
        self.now
    }
}
