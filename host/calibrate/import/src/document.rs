//! YAML texts, with the peculiarities of the programs that write them, and the matrices and poses
//! in them.

use nalgebra::Isometry3;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::Program;
use crate::error::ImportError;

/// Longest text, bytes. A chain of kalibr has about a thousand for each camera.
const MAX_BYTES: usize = 1 << 20;

/// Returns the keys of the first document of a YAML text, with their values.
///
/// # Errors
/// If the text is longer than [`MAX_BYTES`], is XML or no YAML, or has no keys.
pub(crate) fn parse(text: &str) -> Result<Map<String, Value>, ImportError> {
    if text.len() > MAX_BYTES {
        return Err(ImportError::Long { bytes: text.len(), limit: MAX_BYTES });
    }
    let text = text.trim_start_matches('\u{feff}');
    if text.trim_start().starts_with('<') {
        return Err(ImportError::Xml);
    }
    let documents: Vec<Value> = serde_saphyr::from_multiple(&without_directives(text))
        .map_err(|error| ImportError::NoYaml { why: first_line(&error.to_string()) })?;
    match documents.into_iter().next() {
        Some(Value::Object(file)) => Ok(file),
        _ => Err(ImportError::NoKeys),
    }
}

/// Returns a text without the directives at its start: OpenCV's `%YAML:1.0` is none of YAML's.
fn without_directives(text: &str) -> String {
    let lines = text.lines().skip_while(|line| line.starts_with('%') || line.trim().is_empty());
    lines.fold(String::with_capacity(text.len()), |text, line| text + line + "\n")
}

/// Returns the first line of a message; further ones draw the place.
fn first_line(message: &str) -> String {
    message.lines().next().unwrap_or_default().to_owned()
}

/// Reads the keys that `T` has.
///
/// # Errors
/// If a key is missing, or has a value of another kind.
pub(crate) fn typed<T: DeserializeOwned>(
    program: Program,
    keys: &Map<String, Value>,
) -> Result<T, ImportError> {
    serde_json::from_value(Value::Object(keys.clone()))
        .map_err(|error| ImportError::Key { program, why: error.to_string() })
}

/// Pose of a camera in the frame of a robot's base.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedPose {
    /// Camera axes (x right, y down, z forward) into the frame of the base, metres.
    pub pose: Isometry3<f64>,
    /// Name of the frame of the base. It must be the rig frame.
    pub base: String,
    /// Name of the frame of the camera.
    pub camera: String,
}

/// Matrix or vector.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub(crate) enum Matrix {
    /// Its numbers by rows.
    Flat(Vec<f64>),
    /// Its rows.
    Rows(Vec<Vec<f64>>),
    /// That of ROS and of OpenCV: its numbers by rows beside its size.
    Sized {
        /// Number of rows.
        rows: usize,
        /// Number of columns.
        cols: usize,
        /// The numbers.
        data: Vec<f64>,
    },
}

impl Matrix {
    /// Returns the numbers by rows.
    ///
    /// # Errors
    /// If their count is not that of rows and columns.
    pub(crate) fn numbers(&self, name: &str) -> Result<Vec<f64>, ImportError> {
        match self {
            Self::Flat(numbers) => Ok(numbers.clone()),
            Self::Rows(rows) => Ok(rows.concat()),
            Self::Sized { rows, cols, data } if rows.checked_mul(*cols) == Some(data.len()) => {
                Ok(data.clone())
            }
            Self::Sized { rows, cols, data } => Err(ImportError::Matrix {
                name: name.to_owned(),
                wanted: format!("{rows} x {cols}"),
                count: data.len(),
            }),
        }
    }

    /// Returns the focal lengths and the principal point of a camera matrix, pixels: fx, fy, cx,
    /// cy.
    ///
    /// # Errors
    /// If it has another size than 3 x 3, or pixels that are skew.
    pub(crate) fn pinhole(&self, name: &str) -> Result<[f64; 4], ImportError> {
        let numbers = self.numbers(name)?;
        let [fx, skew, cx, zero, fy, cy, _, _, _] = numbers[..] else {
            return Err(ImportError::Matrix {
                name: name.to_owned(),
                wanted: "3 x 3".to_owned(),
                count: numbers.len(),
            });
        };
        if skew != 0.0 || zero != 0.0 {
            return Err(ImportError::Skew { name: name.to_owned(), skew });
        }
        Ok([fx, fy, cx, cy])
    }
}
