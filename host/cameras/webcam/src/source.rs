//! Webcams as sources of frames without depth.

use std::time::Instant;

use plumb_frame::camera::Intrinsics;
use plumb_frame::clock::LiveClock;
use plumb_frame::file_intrinsics::FileIntrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::image::Image;
use plumb_frame::source::{CameraSource, InvalidFrame, SourceError};

use crate::error::WebcamError;
use crate::settings::WebcamSettings;
use crate::webcam::Webcam;

/// Webcam. Its frames have no depth; their time stamps are seconds since it was opened.
pub struct WebcamSource {
    webcam: Webcam,
    intrinsics: Intrinsics,
    clock: LiveClock,
}

impl WebcamSource {
    /// Opens a webcam, whose frames have `intrinsics` without depth.
    ///
    /// # Errors
    /// As [`Webcam::open`]; where the intrinsics do not fit the pictures.
    pub fn open(
        settings: &WebcamSettings,
        intrinsics: impl Into<FileIntrinsics>,
    ) -> Result<Self, WebcamError> {
        Self::of(Webcam::open(settings)?, intrinsics.into())
    }

    /// Returns the frames of `webcam`.
    pub(crate) fn of(webcam: Webcam, intrinsics: FileIntrinsics) -> Result<Self, WebcamError> {
        let intrinsics = intrinsics.of_pictures(webcam.mode().size, webcam.path().display())?;
        let intrinsics = Intrinsics { depth_scale: 0.0, ..intrinsics };
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

impl CameraSource for WebcamSource {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        let clock = &self.clock;
        // Only a camera that delivers nothing is over.
        let picture = self.webcam.next_picture(|| clock.now()).map_err(|error| {
            let is_over = matches!(error, WebcamError::Lost { .. });
            SourceError::lost(error, !is_over)
        });
        let (time, colour) = picture?;
        let depth = Image::filled(colour.width(), colour.height(), 0);
        let frame = RgbdFrame::new(time, colour, depth, self.intrinsics);
        Ok(Some(frame.map_err(InvalidFrame::of(self.webcam.path().display().to_string()))?))
    }

    fn now(&self) -> f64 {
        self.clock.now()
    }

    fn clock(&self) -> Option<LiveClock> {
        Some(self.clock.clone())
    }
}
