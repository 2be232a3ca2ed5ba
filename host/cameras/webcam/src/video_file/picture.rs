//! Pictures as OpenCV delivers them.

use std::path::Path;

use opencv::core::{Mat, MatTraitConst, MatTraitConstManual, StsError, Vec3b};
use opencv::videoio::{VideoCapture, VideoCaptureTrait};
use plumb_frame::image::{ColourImage, Image};

use super::VideoFileError;

/// Picture without depth.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// When it was taken, seconds since the first picture of the file.
    pub time: f64,
    /// Its pixels.
    pub colour: ColourImage,
}

/// Returns the function that makes an error of OpenCV one of the file at `path`.
pub(super) fn failed(path: &Path) -> impl Fn(opencv::Error) -> VideoFileError {
    move |error| VideoFileError::Library { path: path.to_owned(), source: error.into() }
}

/// Decodes the picture that `capture` has grabbed, taken at `time`, seconds. Returns `None` where
/// there is none.
pub(super) fn retrieve(
    capture: &mut VideoCapture,
    time: f64,
) -> Result<Option<Picture>, opencv::Error> {
    let mut mat = Mat::default();
    if !capture.retrieve_def(&mut mat)? || mat.empty() {
        return Ok(None);
    }
    let pixels = mat.data_typed::<Vec3b>()?.iter().map(|pixel| pixel.0).collect();
    let colour = Image::new(mat.cols() as usize, mat.rows() as usize, pixels);
    let colour = colour.map_err(|error| opencv::Error::new(StsError, error.to_string()))?;
    Ok(Some(Picture { time, colour }))
}
