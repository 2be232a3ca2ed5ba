//! Failures of a synthetic camera.

use plumb_frame::camera::DistortionError;
use plumb_frame::frame::FrameError;
use plumb_frame::image::ImageError;
use thiserror::Error;

/// Reason that a synthetic camera or its frame could not be made.
#[derive(Debug, Error)]
pub enum SyntheticError {
    /// A number that cannot be.
    #[error("synthetic camera: {what} is {value}, but must be {must}")]
    Value {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its valid range.
        must: &'static str,
    },
    /// The intrinsics are those of a frame of another size.
    #[error(
        "synthetic camera: its principal point ({cx}, {cy}) is not in a frame of \
         {width}x{height}; give the background's own intrinsics"
    )]
    Intrinsics {
        /// Principal point, pixels.
        cx: f64,
        /// Principal point, pixels.
        cy: f64,
        /// Columns of the background.
        width: usize,
        /// Rows of the background.
        height: usize,
    },
    /// A part of the frame has no ray.
    #[error("synthetic camera: the lens distortion does not fit the frame")]
    Distortion(#[from] DistortionError),
    /// The rendered frame is invalid (its time stamp).
    #[error("synthetic camera: the rendered frame is invalid")]
    Frame(#[from] FrameError),
    /// The rendered pixels do not make an image of the frame's size.
    #[error("synthetic camera: the rendered pixels do not make an image")]
    Image(#[from] ImageError),
    /// OpenCV refused an operation.
    #[error("synthetic camera: OpenCV refused an operation")]
    OpenCv(#[from] opencv::Error),
}
