//! Interface of a camera source.

use std::task::Waker;
use std::time::Duration;

use plumb_frame::frame::RgbdFrame;

use super::clock::LiveClock;
use super::error::SourceError;

/// Camera or recording that delivers RGB-D frames one after the other.
///
/// A camera implements [`next_frame`](Self::next_frame), [`now`](Self::now),
/// [`is_live`](Self::is_live) and [`clock`](Self::clock). [`Capture`](super::capture::Capture)
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
    /// camera. The clock of a recording that is read at any speed stands at its last frame.
    fn is_live(&self) -> bool;

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
