//! Pictures as OpenCV delivers them.

use std::path::Path;

use opencv::core::{Mat, MatTraitConst, MatTraitConstManual, Vec3b};
use opencv::videoio::{VideoCapture, VideoCaptureTrait};

use crate::error::WebcamError;

/// Picture without depth.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// When it was taken, seconds: of a camera on the host's clock, of a file since its first
    /// picture.
    pub time: f64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixels row by row: blue, green, red.
    pub bgr: Vec<[u8; 3]>,
}

/// Returns the function that makes an error of OpenCV one of the device or file at `path`.
pub(crate) fn failed(path: &Path) -> impl Fn(opencv::Error) -> WebcamError {
    move |error| WebcamError::Library { path: path.to_owned(), source: error.into() }
}

/// Decodes the picture that `capture` has grabbed, taken at `time`, seconds. Returns `None` where
/// there is none.
pub(crate) fn retrieve(
    capture: &mut VideoCapture,
    time: f64,
) -> Result<Option<Picture>, opencv::Error> {
    let mut mat = Mat::default();
    if !capture.retrieve_def(&mut mat)? || mat.empty() {
        return Ok(None);
    }
    let (width, height) = (mat.cols() as usize, mat.rows() as usize);
    let pixels = mat.data_typed::<Vec3b>()?;
    Ok(Some(Picture { time, width, height, bgr: pixels.iter().map(|pixel| pixel.0).collect() }))
}

/// Checks that a picture has the size of the first one.
pub(crate) fn check_size(
    picture: Picture,
    (width, height): (usize, usize),
    path: &Path,
) -> Result<Picture, WebcamError> {
    if (picture.width, picture.height) == (width, height) {
        return Ok(picture);
    }
    let Picture { width, height, .. } = picture;
    Err(WebcamError::OtherSize { path: path.to_owned(), width, height })
}
