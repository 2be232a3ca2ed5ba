//! YAML texts, with the peculiarities of the programs that write them.

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

/// Returns a text without the directives at its begin: OpenCV's `%YAML:1.0` is none of YAML's.
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
