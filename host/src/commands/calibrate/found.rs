//! Pose that a calibration has found.

use nalgebra::Point3;
use plumb_calibrate::calibration::Calibration;
use plumb_calibrate::overlay::draw;
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::ColourImage;

use super::report::Way;
use crate::cli::exit::Failure;

/// Result of one of the ways, with the last picture.
pub(super) struct Found {
    pub(super) way: Way,
    pub(super) calibration: Calibration,
    pub(super) frame: RgbdFrame,
    /// Closed line to draw, rig frame, metres.
    pub(super) outline: Vec<Point3<f64>>,
}

impl Found {
    pub(super) fn draw(&self) -> Result<ColourImage, Failure> {
        let (frame, outline) = (&self.frame, &self.outline);
        let (colour, intrinsics) = (frame.colour(), frame.intrinsics());
        Ok(draw(colour, intrinsics, &self.calibration, outline)?)
    }
}
