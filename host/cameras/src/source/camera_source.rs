//! Interface of a camera source.

use plumb_vision::frame::RgbdFrame;

use super::error::SourceError;

/// Camera or recording that delivers RGB-D frames one after the other.
pub trait CameraSource {
    /// Returns the next frame, or `None` at the end of a recording.
    ///
    /// # Errors
    /// Where a frame is lost. The next call may deliver the frame after it, unless
    /// [`SourceError::is_over`] says that no frame comes any more.
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError>;

    /// Returns the time on the clock that stamps the frames, seconds. The difference to a frame's
    /// time stamp is the frame's age.
    fn now(&self) -> f64;

    /// Returns whether the clock runs by itself and the frames show the present, as those of a
    /// camera. The clock of a recording that is read at any speed stands at its last frame.
    fn is_live(&self) -> bool;
}

impl<S: CameraSource + ?Sized> CameraSource for Box<S> {
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
        (**self).next_frame()
    }

    fn now(&self) -> f64 {
        (**self).now()
    }

    fn is_live(&self) -> bool {
        (**self).is_live()
    }
}
