//! Reads what other programs have calibrated: the lens of a camera, or its pose.
//!
//! | file | of | content |
//! |---|---|---|
//! | `camera_matrix`, `distortion_model` | ROS, `camera_calibration` | lens |
//! | `k`, `d` (`K`, `D` in ROS 1) | ROS, a printed message `CameraInfo` | lens |
//! | `cam0`, `cam1`, ... | kalibr, `camchain` | lens of each camera |
//! | `camera_matrix` without a model | OpenCV, `FileStorage` in YAML | lens |
//! | `transformation` or `transform` | easy_handeye, easy_handeye2 | pose |
//!
//! A lens is OpenCV's model with five coefficients. A pose turns the camera's axes (x right, y
//! down, z forward) into the frame that the file calls the robot's base.
//!
//! ```
//! use plumb_import::{Choice, Content, read};
//!
//! let text = "cam0:\n  camera_model: pinhole\n  intrinsics: [605.0, 606.0, 322.0, 241.0]\n  \
//!             distortion_model: radtan\n  distortion_coeffs: [-0.1, 0.02, 0.001, -0.002]\n  \
//!             resolution: [640, 480]\n";
//! let imported = read(text, Choice::Only, None)?;
//! let Content::Lens(lens) = imported.content else { panic!("a camchain has a lens") };
//! assert_eq!((lens.fx, lens.cy), (605.0, 241.0));
//! # Ok::<(), plumb_import::ImportError>(())
//! ```
//!
//! The crate reads no files.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod document;
mod error;
mod handeye;
mod kalibr;
mod lens;
mod opencv;
mod ros;
#[cfg(test)]
mod tests;

use std::fmt;

pub use document::ImportedPose;
pub use error::ImportError;
pub use lens::ImportedLens;
use serde_json::{Map, Value};

/// Which camera of a file with several is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice<'a> {
    /// The only one.
    Only,
    /// The one of this name, such as `cam1`.
    Named(&'a str),
}

/// Program that wrote a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Program {
    /// ROS's `camera_calibration`.
    CameraCalibration,
    /// A printed message `sensor_msgs/CameraInfo` of ROS.
    CameraInfo,
    /// kalibr.
    Kalibr,
    /// OpenCV.
    OpenCv,
    /// easy_handeye or easy_handeye2.
    EasyHandEye,
}

impl fmt::Display for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::CameraCalibration => "ROS's camera_calibration",
            Self::CameraInfo => "ROS's CameraInfo",
            Self::Kalibr => "kalibr",
            Self::OpenCv => "OpenCV",
            Self::EasyHandEye => "easy_handeye",
        })
    }
}

/// What a file says of a camera.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Intrinsics and distortion.
    Lens(ImportedLens),
    /// Pose in the frame of a robot's base.
    Pose(ImportedPose),
}

/// Calibration of another program.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// Program that wrote the file.
    pub program: Program,
    /// What the file says.
    pub content: Content,
    /// What the file says besides and is not taken, a sentence each.
    pub notes: Vec<String>,
}

/// Reads the text of a calibration file. `choice` names one of the cameras in a file of kalibr, and
/// `model` the distortion of a file of OpenCV with four coefficients: `plumb_bob` or `fisheye`.
///
/// # Errors
/// If the text is no YAML, or of no program above; if a value is missing or no finite number; if
/// the lens has another model than OpenCV's with five coefficients; if the camera moves with the
/// robot.
pub fn read(text: &str, choice: Choice<'_>, model: Option<&str>) -> Result<Imported, ImportError> {
    let mut imported = read_file(&document::parse(text)?, choice, model)?;
    if let Some(model) = model.filter(|_| imported.program != Program::OpenCv) {
        return Err(ImportError::NamesModel { model: model.to_owned() });
    }
    if let Content::Lens(lens) = &imported.content {
        imported.notes.extend(lens.doubt());
    }
    Ok(imported)
}

fn read_file(
    file: &Map<String, Value>,
    choice: Choice<'_>,
    model: Option<&str>,
) -> Result<Imported, ImportError> {
    let cameras = kalibr::cameras(file);
    if !cameras.is_empty() {
        return kalibr::read(file, &cameras, choice);
    }
    if let Choice::Named(name) = choice {
        return Err(ImportError::NoCameras { name: name.to_owned() });
    }
    if handeye::is_one(file) {
        handeye::read(file)
    } else if ros::is_calibration(file) {
        ros::read_calibration(file)
    } else if ros::is_message(file) {
        ros::read_message(file)
    } else if opencv::is_one(file) {
        opencv::read(file, model)
    } else {
        let keys = file.keys().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ");
        Err(ImportError::Unknown { keys })
    }
}
