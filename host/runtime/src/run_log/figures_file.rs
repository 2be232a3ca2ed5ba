//! `figures.json`: content of the figures besides the rows, so that they can be drawn again.

use std::path::Path;

use nalgebra::Point3;
use plumb_config::bounded_read::read_text;
use plumb_config::quantity::Coordinate;
use serde::{Deserialize, Deserializer, Serialize};

use super::output_dir::write_new;
use super::{FigureSettings, RunLogError};
use crate::rig::MotorPoints;
use crate::rig::quantity::Distance;

/// Name of the file in the folder of the run.
const FILE: &str = "figures.json";

/// Largest file that is read, bytes.
const MAX_BYTES: u64 = 64 << 10;

/// Content of the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    title: String,
    #[serde(deserialize_with = "threshold")]
    threshold_m: f64,
    /// Motor points A, B, C, metres in the rig frame; `None` where they are unknown.
    #[serde(default, deserialize_with = "motors")]
    motors_m: Option<[[f64; 3]; 3]>,
    /// Whether a person has measured them.
    #[serde(default)]
    motors_are_approximate: bool,
}

/// Reads a threshold, metres.
fn threshold<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Distance::deserialize(deserializer).map(Distance::get)
}

/// Reads the motor points, metres.
fn motors<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<[[f64; 3]; 3]>, D::Error> {
    let motors = Option::<[[Coordinate; 3]; 3]>::deserialize(deserializer)?;
    Ok(motors.map(|motors| motors.map(|motor| motor.map(Coordinate::get))))
}

/// Writes the file into `folder`.
///
/// # Errors
/// Where it exists or cannot be written (a full disk).
pub(super) fn write(folder: &Path, settings: &FigureSettings) -> Result<(), RunLogError> {
    let path = folder.join(FILE);
    let content = Content {
        title: settings.title.clone(),
        threshold_m: settings.threshold_m,
        motors_m: settings.motors.map(|motors| motors.places.map(Into::into)),
        motors_are_approximate: settings.motors.is_some_and(|motors| motors.is_approximate),
    };
    match serde_json::to_vec_pretty(&content) {
        Ok(mut json) => {
            json.push(b'\n');
            write_new(&path, &json)
        }
        Err(source) => Err(RunLogError::Json { path, source }),
    }
}

/// Reads the file of `folder`.
///
/// # Errors
/// Where it cannot be read, has another content, or a number is out of its range.
pub(super) fn read(folder: &Path) -> Result<FigureSettings, RunLogError> {
    let path = folder.join(FILE);
    let text = read_text(&path, MAX_BYTES)
        .map_err(|source| RunLogError::NotARun { folder: folder.into(), source: source.into() })?;
    let content: Content = serde_json::from_str(&text)
        .map_err(|source| RunLogError::NotARun { folder: folder.into(), source: source.into() })?;
    let Content { title, threshold_m, motors_m, motors_are_approximate: is_approximate } = content;
    let motors = motors_m.map(|motors| {
        let places = motors.map(Point3::from);
        MotorPoints { places, is_approximate }
    });
    Ok(FigureSettings { title, threshold_m, motors })
}
