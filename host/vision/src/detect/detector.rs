//! The interface of all detectors.

use std::error::Error;

use thiserror::Error;

use super::shape::DetectionTrace;
use crate::frame::RgbdFrame;
use crate::observation::BallObservation;

/// Reasons why a frame could not be searched (a frame without a ball is not an error).
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DetectError {
    /// An operation on an image failed, for example for lack of memory.
    #[error("image processing failed")]
    Processing(#[source] Box<dyn Error + Send + Sync>),
}

impl DetectError {
    /// Wraps the error of the library that a detector processes images with.
    pub fn processing(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Processing(error.into())
    }
}

/// A detector: finds the ball in a frame.
pub trait BallDetector {
    /// Returns the detector's name, as in the configuration.
    fn name(&self) -> &'static str;

    /// Returns the observation of the ball in `frame`; `None` if there is no ball.
    ///
    /// # Errors
    /// Returns an error if the frame could not be searched.
    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError>;

    /// As [`Self::detect`], with what each stage found. The default implementation has no stages.
    ///
    /// # Errors
    /// As [`Self::detect`].
    fn detect_traced(
        &mut self,
        frame: &RgbdFrame,
    ) -> Result<(Option<BallObservation>, DetectionTrace), DetectError> {
        Ok((self.detect(frame)?, DetectionTrace::default()))
    }

    /// Forgets where the ball was: the next frame is searched like a first one.
    fn reset(&mut self) {}
}
