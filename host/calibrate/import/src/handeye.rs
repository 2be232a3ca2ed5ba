//! Results of easy_handeye and easy_handeye2: a transform from the camera's frame into that of the
//! robot's base, as `tf` has it.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::Deserialize;
use serde_json::{Map, Value};

use crate::document::{ImportedPose, typed};
use crate::error::ImportError;
use crate::{Content, Imported, Program};

/// Largest difference of the norm of a rotation from 1: numbers with two digits.
const NORM_TOLERANCE: f64 = 0.01;
/// End of the name of a frame with the axes of a body: x forward, y left, z up (REP 103).
const BODY: &str = "_link";
/// End of the name of a frame with the axes of a camera: x right, y down, z forward (REP 103).
const OPTICAL: &str = "optical_frame";
/// easy_handeye2's word for a camera that moves with the robot.
const IN_HAND: &str = "eye_in_hand";

/// Result of easy_handeye.
#[derive(Deserialize)]
struct First {
    transformation: Transformation,
}

#[derive(Deserialize)]
struct Transformation {
    x: f64,
    y: f64,
    z: f64,
    qx: f64,
    qy: f64,
    qz: f64,
    qw: f64,
}

/// Result of easy_handeye2.
#[derive(Deserialize)]
struct Second {
    transform: Transform,
}

#[derive(Deserialize)]
struct Transform {
    translation: Translation,
    rotation: Rotation,
}

#[derive(Deserialize)]
struct Translation {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Deserialize)]
struct Rotation {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

/// What a calibration was for. The first versions of easy_handeye wrote it beside the result,
/// later ones into a table.
#[derive(Deserialize)]
struct Parameters {
    #[serde(default)]
    eye_on_hand: bool,
    #[serde(default)]
    calibration_type: String,
    robot_base_frame: String,
    tracking_base_frame: String,
}

/// Returns whether a file is a result of one of the two programs.
pub(crate) fn is_one(file: &Map<String, Value>) -> bool {
    let has = |key: &str, part: &str| file.get(key).is_some_and(|value| value.get(part).is_some());
    has("transformation", "qw") || has("transform", "rotation")
}

/// Reads the pose.
///
/// # Errors
/// As [`read`](crate::read); if the camera moves with the robot, its frame has the axes of a body,
/// or the rotation is none.
pub(crate) fn read(file: &Map<String, Value>) -> Result<Imported, ImportError> {
    let program = Program::EasyHandEye;
    let parameters: Parameters = match file.get("parameters") {
        Some(Value::Object(keys)) => typed(program, keys)?,
        _ => typed(program, file)?,
    };
    if parameters.eye_on_hand || parameters.calibration_type == IN_HAND {
        return Err(ImportError::InHand);
    }
    let Parameters { robot_base_frame: base, tracking_base_frame: camera, .. } = parameters;
    if camera.ends_with(BODY) {
        return Err(ImportError::Body { camera });
    }
    let (place, rotation) = transform(file)?;
    let pose = pose(place, rotation)?;
    let mut notes = vec![format!("`{base}` must be the rig frame")];
    if !camera.ends_with(OPTICAL) {
        notes.push(format!("the axes of `{camera}` must be x right, y down, z forward"));
    }
    let content = Content::Pose(ImportedPose { pose, base, camera });
    Ok(Imported { program, content, notes })
}

/// Returns the translation (m) and the rotation (x, y, z, w) of a result.
fn transform(file: &Map<String, Value>) -> Result<([f64; 3], [f64; 4]), ImportError> {
    if file.contains_key("transformation") {
        let it = typed::<First>(Program::EasyHandEye, file)?.transformation;
        return Ok(([it.x, it.y, it.z], [it.qx, it.qy, it.qz, it.qw]));
    }
    let Transform { translation, rotation } =
        typed::<Second>(Program::EasyHandEye, file)?.transform;
    let place = [translation.x, translation.y, translation.z];
    Ok((place, [rotation.x, rotation.y, rotation.z, rotation.w]))
}

/// Returns a pose.
///
/// # Errors
/// If a number is not finite, or the rotation has another norm than 1.
fn pose(place: [f64; 3], rotation: [f64; 4]) -> Result<Isometry3<f64>, ImportError> {
    let quaternion = Quaternion::from(rotation);
    let norm = quaternion.norm();
    let is_possible =
        place.iter().all(|number| number.is_finite()) && (norm - 1.0).abs() <= NORM_TOLERANCE;
    if !is_possible {
        return Err(ImportError::Transform { place, norm });
    }
    let rotation = UnitQuaternion::from_quaternion(quaternion);
    Ok(Isometry3::from_parts(Translation3::from(place), rotation))
}
