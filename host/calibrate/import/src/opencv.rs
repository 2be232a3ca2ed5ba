//! Matrices that programs with OpenCV keep. There is no standard for their names: these are the
//! names of OpenCV's samples and tutorials.

use plumb_frame::image::ImageSize;
use serde::Deserialize;
use serde_json::{Map, Value};

use crate::document::Matrix;
use crate::error::ImportError;
use crate::lens::{ImportedLens, check_model};
use crate::{Content, Imported, Program};

/// Names of the camera matrix.
const MATRICES: [&str; 8] =
    ["camera_matrix", "Camera_Matrix", "cameraMatrix", "intrinsic_matrix", "mtx", "K", "M", "M1"];
/// Names of the coefficients of the distortion.
const COEFFICIENTS: [&str; 11] = [
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distortionCoefficients",
    "dist_coefficients",
    "distCoeffs",
    "dist_coeffs",
    "dist_coeff",
    "distortion",
    "dist",
    "D",
    "D1",
];
/// Names of columns and rows of the pictures.
const SIZES: [[&str; 2]; 3] =
    [["image_width", "image_height"], ["image_Width", "image_Height"], ["width", "height"]];
/// Names of both together.
const PAIRS: [&str; 3] = ["image_size", "imageSize", "resolution"];
/// Names of another camera in the same file.
const SECOND: [&str; 2] = ["M2", "K2"];
/// Poses of the calibration's pictures.
const POSES: [&str; 4] = ["extrinsic_parameters", "Extrinsic_Parameters", "rvecs", "tvecs"];
/// Keys with a true value for a fisheye lens.
const FISHEYE: [&str; 2] = ["fisheye_model", "fisheye"];

/// Returns whether a file has a camera matrix.
pub(crate) fn is_one(file: &Map<String, Value>) -> bool {
    first(file, &MATRICES).is_some()
}

/// Reads the matrices.
///
/// # Errors
/// As [`read`](crate::read); if the file has two cameras, or no coefficients of the distortion.
pub(crate) fn read(
    file: &Map<String, Value>,
    model: Option<&str>,
) -> Result<Imported, ImportError> {
    if first(file, &SECOND).is_some() {
        return Err(ImportError::Stereo);
    }
    if first(file, &FISHEYE).is_some_and(|(_, value)| is_true(value)) {
        return Err(ImportError::Model { model: "fisheye".to_owned() });
    }
    let (name, camera) = matrix(file, &MATRICES)?;
    let pinhole = camera.pinhole(name)?;
    let (name, coefficients) = matrix(file, &COEFFICIENTS)?;
    let coefficients = coefficients.numbers(name)?;
    match model {
        Some(model) => check_model(model, &coefficients)?,
        None if coefficients.len() == 4 => {
            return Err(ImportError::Ambiguous { name: name.to_owned() });
        }
        None => {}
    }
    let lens = ImportedLens::new(pinhole, &coefficients, size(file))?;
    let notes = first(file, &POSES).map(|(key, _)| {
        format!("`{key}` is the place of the board in each picture, and is not taken")
    });
    let content = Content::Lens(lens);
    Ok(Imported { program: Program::OpenCv, content, notes: notes.into_iter().collect() })
}

/// Returns the first of `names` that the file has, with its value.
fn first<'a>(file: &'a Map<String, Value>, names: &[&'a str]) -> Option<(&'a str, &'a Value)> {
    names.iter().find_map(|name| file.get(*name).map(|value| (*name, value)))
}

/// Returns the matrix under the first of `names` that the file has.
fn matrix<'a>(
    file: &'a Map<String, Value>,
    names: &[&'a str],
) -> Result<(&'a str, Matrix), ImportError> {
    let absent = || ImportError::Absent { names: names.join(", ") };
    let (name, value) = first(file, names).ok_or_else(absent)?;
    let matrix = Matrix::deserialize(value).map_err(|_| {
        let why = format!("`{name}` is no matrix of numbers");
        ImportError::Key { program: Program::OpenCv, why }
    })?;
    Ok((name, matrix))
}

/// Returns whether a value is true; OpenCV writes 0 and 1.
fn is_true(value: &Value) -> bool {
    value.as_bool().unwrap_or_else(|| value.as_f64().is_some_and(|number| number != 0.0))
}

/// Returns the size of the pictures; `None` where the file does not say.
fn size(file: &Map<String, Value>) -> Option<ImageSize> {
    let number = |value: &Value| value.as_u64().and_then(|number| usize::try_from(number).ok());
    let apart = SIZES.iter().find_map(|[width, height]| {
        Some([number(file.get(*width)?)?, number(file.get(*height)?)?])
    });
    let together = || {
        let (_, value) = first(file, &PAIRS)?;
        <[usize; 2]>::deserialize(value).ok()
    };
    apart.or_else(together).map(|[width, height]| ImageSize { width, height })
}
