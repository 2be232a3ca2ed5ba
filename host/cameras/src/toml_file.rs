//! Reading configuration files (TOML) such that a mistake is named with its file, its line and its
//! key.

use std::path::{Path, PathBuf};

use serde::{Deserialize, de::DeserializeOwned};
use thiserror::Error;

use crate::bounded_read::{ReadError, excerpt, read_text};

/// Largest file that is read, bytes. Parsed it takes some 60 times as much memory.
pub const MAX_BYTES: u64 = 1 << 20;

/// Why a TOML file could not be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TomlFileError {
    /// The file could not be read, or is too large.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// What stands in the file is not what is asked for: a syntax error, an unknown key, a missing
    /// field or a value out of its range.
    #[error("{}", at_line(.path, *.line, .key, .message))]
    Content {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1. For a missing field that of its table's header, for a missing
        /// table the file's last.
        line: usize,
        /// The key with its tables, `intrinsics.fx`; empty where the mistake belongs to no key.
        key: String,
        /// What is wrong.
        message: String,
    },
}

/// "FILE:LINE: in `KEY`: what is wrong", so that editors can jump there.
fn at_line(path: &Path, line: usize, key: &str, message: &str) -> String {
    match key {
        "" => format!("{}:{line}: {message}", path.display()),
        _ => format!("{}:{line}: in `{key}`: {message}", path.display()),
    }
}

/// The contents of the TOML file at `path`, of at most [`MAX_BYTES`].
///
/// Give `T` and all it holds `#[serde(deny_unknown_fields)]`, and check values while they are read
/// (with `#[serde(try_from = "...")]`, see [`Positive`]), so that they are named with their lines
/// too.
///
/// # Errors
/// Where the file cannot be read, or where it does not say a `T`; with file, line and key.
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, TomlFileError> {
    parse_toml(path, &read_text(path, MAX_BYTES)?)
}

/// As [`read_toml`], of `text` that is already read; `path` is only used to name it.
///
/// # Errors
/// Where the text does not say a `T`.
pub fn parse_toml<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, TomlFileError> {
    toml::from_str(text).map_err(|error| {
        let key = key_of(error.clone());
        let line = line_of(text, &error, &key);
        let mut message = error.message().replace('\n', " ");
        if key.is_empty() && !message.starts_with("missing field") {
            let quoted = excerpt(text.lines().nth(line - 1).unwrap_or_default().trim());
            message = format!("{message}: {quoted}");
        }
        TomlFileError::Content { path: path.to_path_buf(), line, key, message }
    })
}

/// The line (from 1) that a mistake is on. What is missing at the top level is missing at the
/// file's end: the crate `toml` puts it at the beginning.
fn line_of(text: &str, error: &toml::de::Error, key: &str) -> usize {
    let end = text.trim_end().len();
    let missing = key.is_empty() && error.message().starts_with("missing field");
    let start = match error.span() {
        Some(span) if !missing => span.start.min(text.len()),
        _ => end,
    };
    1 + text.as_bytes()[..start].iter().filter(|&&b| b == b'\n').count()
}

/// The dotted key that an error belongs to. The crate `toml` says it only in the text of an error
/// that does not know its input, in a last line "in `a.b`".
fn key_of(mut error: toml::de::Error) -> String {
    error.set_input(None);
    let text = error.to_string();
    let last = text.trim_end().rsplit('\n').next().unwrap_or_default();
    last.strip_prefix("in `").and_then(|k| k.strip_suffix('`')).unwrap_or_default().to_owned()
}

/// A finite number above zero, checked while it is read.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Deserialize)]
#[serde(try_from = "f64")]
pub struct Positive(f64);

/// A finite number, checked while it is read.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Deserialize)]
#[serde(try_from = "f64")]
pub struct Finite(f64);

/// A number out of its range.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum NumberError {
    /// Not a number above zero, or infinite.
    #[error("{0} must be a finite number above 0")]
    NotPositive(f64),
    /// Infinite or not a number.
    #[error("{0} must be a finite number")]
    NotFinite(f64),
}

impl Positive {
    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl Finite {
    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for Positive {
    type Error = NumberError;

    fn try_from(x: f64) -> Result<Self, NumberError> {
        if x.is_finite() && x > 0.0 { Ok(Self(x)) } else { Err(NumberError::NotPositive(x)) }
    }
}

impl TryFrom<f64> for Finite {
    type Error = NumberError;

    fn try_from(x: f64) -> Result<Self, NumberError> {
        if x.is_finite() { Ok(Self(x)) } else { Err(NumberError::NotFinite(x)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only whether it can be read matters")]
    struct File {
        rig: Rig,
        camera: Camera,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only whether it can be read matters")]
    struct Rig {
        gain: Positive,
        name: Option<String>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only whether it can be read matters")]
    struct Camera {
        at: [Finite; 3],
    }

    fn error_of(text: &str) -> (usize, String, String) {
        match parse_toml::<File>(Path::new("rig.toml"), text) {
            Err(TomlFileError::Content { line, key, message, .. }) => (line, key, message),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_mistake_is_named_with_line_and_key() {
        let cases = [
            ("# 1\n[rig]\ngain = 1\ngian = 2\n[camera]\nat = [0, 0, 0]\n", 4, "gian"),
            ("# 1\n[rig]\nname = \"a\"\n\n[camera]\nat = [0, 0, 0]\n", 2, "gain"),
            ("[rig]\ngain = 1\n\n# end\n", 4, "camera"),
            ("# 1\n[rig]\ngain = -1.0\n[camera]\nat = [0, 0, 0]\n", 3, "gain"),
            ("[rig]\ngain = 1.0\n[camera]\nat = [0, inf, 0]\n", 4, "at"),
            ("[rig]\ngain = \"x\"\n[camera]\nat = [0, 0, 0]\n", 2, "gain"),
            ("[rig]\ngain = 1\n[camera]\nat = [0, 0]\n", 4, "at"),
            ("[rig]\ngain = 1\n[motor]\nat = [0, 0]\n", 3, "motor"),
            ("[rig]\ngain = 1\ngain = 2\n[camera]\nat = [0, 0, 0]\n", 3, "gain"),
            ("[rig]\ngain 1\n", 2, "gain"),
        ];
        for (text, line, key) in cases {
            let (l, k, m) = error_of(text);
            assert_eq!(l, line, "line of {m:?} ({k:?}) in {text:?}");
            assert!(format!("{k} {m}").contains(key), "{key} in {k:?} {m:?}");
        }
    }

    #[test]
    fn an_empty_file_is_an_error_on_its_first_line() {
        let (line, _, message) = error_of("");
        assert_eq!(line, 1);
        assert!(message.contains("rig"), "{message}");
    }

    #[test]
    fn a_long_line_is_not_quoted_whole() {
        let (line, _, message) = error_of(&format!("\na = {}", "[".repeat(100_000)));
        assert!(line == 2 && message.len() < 300, "{line}: {message:.300}");
    }

    #[test]
    fn a_file_above_the_limit_is_not_parsed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rig.toml");
        std::fs::write(&path, "#".repeat(MAX_BYTES as usize + 1)).unwrap();
        let error = read_toml::<File>(&path).unwrap_err().to_string();
        assert!(error.contains("rig.toml: is too large: it has 1048577 bytes"), "{error}");
        assert!(error.contains("at most 1048576"), "{error}");
    }

    #[test]
    fn an_absent_file_is_named() {
        let error = read_toml::<File>(Path::new("no/such/rig.toml")).unwrap_err();
        assert!(error.to_string().contains("no/such/rig.toml"), "{error}");
    }
}
