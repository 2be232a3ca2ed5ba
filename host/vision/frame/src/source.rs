//! Interface of a camera source, and its errors.

use std::error::Error as StdError;
use std::fmt;
use std::task::Waker;
use std::time::Duration;

use thiserror::Error;

use crate::clock::LiveClock;
use crate::frame::{FrameError, RgbdFrame};

/// Camera or recording that delivers RGB-D frames one after the other.
///
/// A camera implements [`next_frame`](Self::next_frame), [`now`](Self::now) and
/// [`clock`](Self::clock). `Capture` of the crate `plumb-cameras`
/// reads it in a thread of its own and implements the other functions.
pub trait CameraSource {
    /// Returns the next frame, or `None` at the end of a recording.
    ///
    /// # Errors
    /// Where a frame is lost. The next call may deliver the frame after it, unless
    /// the error [is the end](SourceError::is_over) of the source.
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError>;

    /// Returns the time on the clock that stamps the frames, seconds. The difference to a frame's
    /// time stamp is the frame's age.
    fn now(&self) -> f64;

    /// Returns whether the clock runs by itself and the frames show the present, as those of a
    /// camera. The clock of a recording that is read at any speed stands at its last frame. By
    /// default a source with a [`clock`](Self::clock) is live; one in virtual time says so itself.
    fn is_live(&self) -> bool {
        self.clock().is_some()
    }

    /// Returns the clock of [`now`](Self::now) for other threads; `None` where the clock is virtual
    /// or stands.
    fn clock(&self) -> Option<LiveClock> {
        None
    }

    /// Waits for `limit` at most until [`next_frame`](Self::next_frame) can return at once. Returns
    /// whether it can. A [`waker`](Self::waker) ends the wait earlier.
    ///
    /// A source that waits in `next_frame` itself, such as one in virtual time, returns true.
    fn wait(&mut self, _limit: Duration) -> bool {
        true
    }

    /// Returns a handle that ends the present or the next [`wait`](Self::wait) from another thread;
    /// `None` where the source never waits there.
    fn waker(&self) -> Option<Waker> {
        None
    }

    /// Returns the number of frames that a newer one replaced before they were taken.
    fn skipped(&self) -> u64 {
        0
    }
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

    fn clock(&self) -> Option<LiveClock> {
        (**self).clock()
    }

    fn wait(&mut self, limit: Duration) -> bool {
        (**self).wait(limit)
    }

    fn waker(&self) -> Option<Waker> {
        (**self).waker()
    }

    fn skipped(&self) -> u64 {
        (**self).skipped()
    }
}

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
/// use plumb_frame::image::{ImageError, ImageSize};
/// use plumb_frame::source::SourceError;
///
/// let cause = ImageError { size: ImageSize { width: 4, height: 3 }, pixels: 11 };
/// let error = SourceError::over(cause.clone());
/// assert!(error.is_over());
/// assert_eq!(error.to_string(), "no further frame");
/// assert_eq!(error.source().and_then(|cause| cause.downcast_ref()), Some(&cause));
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

    /// Returns the loss of one frame because of a `cause` that `is_transient`, else the end of the
    /// source.
    pub fn lost(cause: impl Into<BoxedError>, is_transient: bool) -> Self {
        Self { is_over: !is_transient, ..Self::new(cause) }
    }

    /// Returns the cause.
    pub fn into_cause(self) -> BoxedError {
        self.cause
    }

    /// Sets the time stamp of the lost frame, seconds on the source's clock; `None` where it is
    /// unknown.
    #[must_use]
    pub fn with_stamp(self, stamp: impl Into<Option<f64>>) -> Self {
        Self { stamp: stamp.into(), ..self }
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
