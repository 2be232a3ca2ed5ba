//! The interface of all detectors.

use std::error::Error;

use thiserror::Error;

use crate::frame::RgbdFrame;
use crate::image::ColourImage;
use crate::observation::{BallObservation, TwoDepths};

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

/// An image of what one stage of a detector found.
#[derive(Debug, Clone, PartialEq)]
pub struct StageImage {
    /// Name of the stage; names sort in the order of the stages.
    pub name: &'static str,
    /// The image.
    pub image: ColourImage,
}

/// A detector: finds the ball in a frame.
pub trait BallDetector {
    /// Returns the name of the detector, such as that of the option `--detector`.
    fn name(&self) -> &'static str;

    /// Returns the observation of the ball in `frame`; `None` if there is no ball.
    ///
    /// # Errors
    /// Returns an error if the frame could not be searched.
    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError>;

    /// As [`Self::detect`], with an image of each stage. The default implementation has no stages.
    ///
    /// # Errors
    /// Returns an error if the frame could not be searched or an image could not be drawn.
    fn detect_with_stages(
        &mut self,
        frame: &RgbdFrame,
    ) -> Result<(Option<BallObservation>, Vec<StageImage>), DetectError> {
        Ok((self.detect(frame)?, Vec::new()))
    }

    /// Returns the two depths of what looks like the ball in `frame` by its colours alone: they
    /// tell why no ball was found. The default implementation knows none.
    ///
    /// # Errors
    /// Returns an error if the frame could not be searched.
    fn compare_depths(&self, _frame: &RgbdFrame) -> Result<Option<TwoDepths>, DetectError> {
        Ok(None)
    }

    /// Returns whether `frame` shows another ball that looks about as much like one as `ball`. The
    /// default implementation sees none.
    ///
    /// # Errors
    /// Returns an error if the frame could not be searched.
    fn has_rival(&self, _frame: &RgbdFrame, _ball: &BallObservation) -> Result<bool, DetectError> {
        Ok(false)
    }

    /// Forgets where the ball was: the next frame is searched like a first one.
    fn reset(&mut self) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_keeps_its_cause() {
        let error = DetectError::processing(std::io::Error::other("out of memory"));
        assert_eq!(error.to_string(), "image processing failed");
        assert_eq!(error.source().unwrap().to_string(), "out of memory");
    }
}
