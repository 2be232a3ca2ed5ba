//! A frame and the ball in it.

use std::sync::Arc;

use plumb_frame::detect::DetectError;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::observation::{BallObservation, Gaussian3};
use plumb_protocol::units::{Covariance, Point};

/// A frame and the ball in it.
pub(super) struct View {
    pub(super) frame: Arc<RgbdFrame>,
    pub(super) ball: Option<BallObservation>,
    /// Error of the detector, if it could not search the frame.
    pub(super) error: Option<DetectError>,
}

impl View {
    /// Returns the ball's position and covariance; `None` if they are unknown.
    pub(super) fn position(&self) -> Option<Gaussian3> {
        self.ball.and_then(|ball| ball.position)
    }

    /// Returns the ball's position for the board; `None` if it is unknown.
    pub(super) fn point(&self) -> Option<Point> {
        self.position().and_then(|position| Point::from_metres(position.mean.into()))
    }

    /// Returns the covariance of the position for the board; `None` if it is unknown.
    pub(super) fn covariance(&self) -> Option<Covariance> {
        let position = self.position()?;
        Covariance::from_metres2(position.covariance.transpose().into())
    }
}
