//! Files of ROS: the result of `camera_calibration`, and a message `sensor_msgs/CameraInfo` that
//! `ros2 topic echo` or `rostopic echo` printed.

use plumb_frame::image::ImageSize;
use serde::Deserialize;
use serde_json::{Map, Value};

use crate::document::{Matrix, typed};
use crate::error::ImportError;
use crate::lens::{ImportedLens, check_model};
use crate::{Content, Imported, Program};

/// What both kinds of file say of rectified pictures.
const RECTIFIED: &str = "the lens is that of the pictures as the camera sends them (image_raw); \
                         rectified pictures (image_rect) have the projection matrix instead";

/// The keys of `camera_calibration` that are read (camera_calibration_parsers).
#[derive(Deserialize)]
struct Calibration {
    image_width: usize,
    image_height: usize,
    camera_matrix: Matrix,
    distortion_model: String,
    distortion_coefficients: Matrix,
}

/// The keys of a message that are read (sensor_msgs/CameraInfo). ROS 1 writes capitals.
#[derive(Deserialize)]
struct Message {
    width: usize,
    height: usize,
    distortion_model: String,
    #[serde(alias = "D")]
    d: Vec<f64>,
    #[serde(alias = "K")]
    k: Matrix,
    #[serde(default)]
    binning_x: u32,
    #[serde(default)]
    binning_y: u32,
    #[serde(default)]
    roi: Roi,
}

/// Window of the sensor that the pictures show; 0 for the whole one.
#[derive(Deserialize, Default)]
#[serde(default)]
struct Roi {
    x_offset: u32,
    y_offset: u32,
    width: u32,
    height: u32,
}

/// Returns whether a file is a result of `camera_calibration`.
pub(crate) fn is_calibration(file: &Map<String, Value>) -> bool {
    file.contains_key("camera_matrix") && file.contains_key("distortion_model")
}

/// Returns whether a file is a printed message.
pub(crate) fn is_message(file: &Map<String, Value>) -> bool {
    let has = |key: &str| file.contains_key(key);
    has("distortion_model") && (has("k") || has("K"))
}

/// Reads the result of `camera_calibration`.
///
/// # Errors
/// As [`read`](crate::read).
pub(crate) fn read_calibration(file: &Map<String, Value>) -> Result<Imported, ImportError> {
    let program = Program::CameraCalibration;
    let it: Calibration = typed(program, file)?;
    let coefficients = it.distortion_coefficients.numbers("distortion_coefficients")?;
    check_model(&it.distortion_model, &coefficients)?;
    let size = ImageSize { width: it.image_width, height: it.image_height };
    let pinhole = it.camera_matrix.pinhole("camera_matrix")?;
    imported(program, ImportedLens::new(pinhole, &coefficients, Some(size))?)
}

/// Reads a printed message.
///
/// # Errors
/// As [`read`](crate::read); if the pictures are a window of the sensor, or binned.
pub(crate) fn read_message(file: &Map<String, Value>) -> Result<Imported, ImportError> {
    let program = Program::CameraInfo;
    let it: Message = typed(program, file)?;
    it.check_window()?;
    check_model(&it.distortion_model, &it.d)?;
    let size = ImageSize { width: it.width, height: it.height };
    imported(program, ImportedLens::new(it.k.pinhole("k")?, &it.d, Some(size))?)
}

impl Message {
    /// Checks that the pictures show the whole sensor.
    fn check_window(&self) -> Result<(), ImportError> {
        let roi = &self.roi;
        let is_whole = |length: u32, whole: usize| length == 0 || length as usize == whole;
        let parts = [
            ("binning_x", self.binning_x, self.binning_x <= 1),
            ("binning_y", self.binning_y, self.binning_y <= 1),
            ("roi.x_offset", roi.x_offset, roi.x_offset == 0),
            ("roi.y_offset", roi.y_offset, roi.y_offset == 0),
            ("roi.width", roi.width, is_whole(roi.width, self.width)),
            ("roi.height", roi.height, is_whole(roi.height, self.height)),
        ];
        match parts.into_iter().find(|(_, _, is_allowed)| !is_allowed) {
            Some((name, value, _)) => Err(ImportError::Window { name, value }),
            None => Ok(()),
        }
    }
}

fn imported(program: Program, lens: ImportedLens) -> Result<Imported, ImportError> {
    let notes = if lens.distortion.is_some() { vec![RECTIFIED.to_owned()] } else { Vec::new() };
    Ok(Imported { program, content: Content::Lens(lens), notes })
}
