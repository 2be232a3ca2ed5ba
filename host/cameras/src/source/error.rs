//! Errors of a camera source.

use std::error::Error as StdError;
use std::fmt;

use plumb_frame::frame::FrameError;
use thiserror::Error;

/// Boxed error of any crate.
pub type BoxedError = Box<dyn StdError + Send + Sync>;

/// Failure of a camera source to deliver a frame.
///
/// The message is what is lost: the frame of a time stamp, one frame or all further ones.
/// [`source`](StdError::source) returns the cause, of whatever type the camera's driver has:
///
/// ```
/// use std::error::Error;
///
/// use plumb_cameras::source::SourceError;
/// use plumb_cameras::source::playback::PlaybackError;
///
/// let error = SourceError::over(PlaybackError::Gap { time: 7.5, gap: 3.0 });
/// assert!(error.is_over());
/// assert_eq!(error.to_string(), "no further frame");
/// let cause = error.source().and_then(|cause| cause.downcast_ref());
/// assert_eq!(cause, Some(&PlaybackError::Gap { time: 7.5, gap: 3.0 }));
/// ```
#[derive(Debug)]
pub struct SourceError {
    is_over: bool,
    stamp: Option<f64>,
    cause: BoxedError,
}

impl SourceError {
    /// Returns the loss of one frame because of `cause`. The source goes on with the next frame.
    pub fn new(cause: impl Into<BoxedError>) -> Self {
        Self { is_over: false, stamp: None, cause: cause.into() }
    }

    /// Returns the end of the source because of `cause`: no frame comes any more.
    pub fn over(cause: impl Into<BoxedError>) -> Self {
        Self { is_over: true, ..Self::new(cause) }
    }

    /// Returns the cause.
    pub(crate) fn into_cause(self) -> BoxedError {
        self.cause
    }

    /// Sets the time stamp of the lost frame, seconds on the source's clock.
    #[must_use]
    pub fn with_stamp(self, stamp: f64) -> Self {
        Self { stamp: Some(stamp), ..self }
    }

    /// Returns whether the source is over: no frame comes any more.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Returns the time stamp of the lost frame, seconds on the source's clock. It is `None` where
    /// no frame is lost or its time stamp is unknown.
    pub fn stamp(&self) -> Option<f64> {
        self.stamp
    }
}

impl fmt::Display for SourceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.stamp {
            Some(stamp) => write!(f, "the frame at {stamp:.6} s"),
            None if self.is_over => f.write_str("no further frame"),
            None => f.write_str("no frame"),
        }
    }
}

impl StdError for SourceError {
    fn source(&self) -> Option<&(dyn StdError + 'static)> {
        Some(&*self.cause)
    }
}

/// Images that do not make a frame.
#[derive(Debug, PartialEq, Error)]
#[error("{origin}: no frame can be made of the images")]
pub struct InvalidFrame {
    /// File or camera that the images come from.
    pub origin: String,
    /// Violated condition.
    #[source]
    pub error: FrameError,
}

impl InvalidFrame {
    /// Returns a function that adds the `origin` of the images to an error.
    pub fn of(origin: impl Into<String>) -> impl FnOnce(FrameError) -> Self {
        move |error| Self { origin: origin.into(), error }
    }
}

impl From<InvalidFrame> for SourceError {
    fn from(error: InvalidFrame) -> Self {
        Self::new(error)
    }
}
