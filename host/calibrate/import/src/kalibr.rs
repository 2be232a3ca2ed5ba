//! Camera chains of kalibr.

use plumb_frame::image::ImageSize;
use serde::Deserialize;
use serde_json::{Map, Value};

use crate::document::typed;
use crate::error::ImportError;
use crate::lens::{ImportedLens, check_model};
use crate::{Choice, Content, Imported, Program};

/// kalibr's name of the camera model that Plumb has.
const PINHOLE: &str = "pinhole";

/// Poses in a chain. None of them is in a frame of the rig.
const POSES: [(&str, &str); 2] = [
    ("T_cam_imu", "the pose of an IMU in the camera's axes"),
    ("T_cn_cnm1", "the pose of the camera before in this camera's axes"),
];

/// The keys of a camera that are read (kalibr's wiki, "Yaml formats").
#[derive(Deserialize)]
struct Camera {
    camera_model: String,
    /// fx, fy, cx, cy, pixels.
    intrinsics: Vec<f64>,
    distortion_model: String,
    #[serde(default)]
    distortion_coeffs: Vec<f64>,
    /// Columns and rows.
    resolution: [usize; 2],
}

/// Returns the names of the cameras in a chain; none for another file.
pub(crate) fn cameras(file: &Map<String, Value>) -> Vec<&str> {
    let is_camera = |value: &Value| value.get("camera_model").is_some();
    file.iter().filter(|(_, value)| is_camera(value)).map(|(name, _)| name.as_str()).collect()
}

/// Reads one of the `cameras` of a chain.
///
/// # Errors
/// As [`read`](crate::read); if the choice names none of them.
pub(crate) fn read(
    file: &Map<String, Value>,
    cameras: &[&str],
    choice: Choice<'_>,
) -> Result<Imported, ImportError> {
    let names = || cameras.join(", ");
    let name = match (choice, cameras) {
        (Choice::Only, [only]) => *only,
        (Choice::Only, _) => return Err(ImportError::Several { names: names() }),
        (Choice::Named(name), _) if cameras.contains(&name) => name,
        (Choice::Named(name), _) => {
            return Err(ImportError::NoCamera { name: name.to_owned(), names: names() });
        }
    };
    let Some(Value::Object(keys)) = file.get(name) else { return Err(ImportError::NoKeys) };
    let camera: Camera = typed(Program::Kalibr, keys)?;
    let content = Content::Lens(camera.lens()?);
    let notes = POSES.into_iter().filter(|(key, _)| keys.contains_key(*key));
    let notes = notes.map(|(key, what)| format!("`{key}` is {what}, and is not taken"));
    Ok(Imported { program: Program::Kalibr, content, notes: notes.collect() })
}

impl Camera {
    fn lens(&self) -> Result<ImportedLens, ImportError> {
        if self.camera_model != PINHOLE {
            return Err(ImportError::Model { model: self.camera_model.clone() });
        }
        check_model(&self.distortion_model, &self.distortion_coeffs)?;
        let pinhole = <[f64; 4]>::try_from(self.intrinsics.as_slice()).map_err(|_| {
            let (name, wanted) = ("intrinsics".to_owned(), "4".to_owned());
            ImportError::Matrix { name, wanted, count: self.intrinsics.len() }
        })?;
        let [width, height] = self.resolution;
        ImportedLens::new(pinhole, &self.distortion_coeffs, Some(ImageSize { width, height }))
    }
}
