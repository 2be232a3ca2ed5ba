//! Configuration files (TOML). Every mistake is reported with its file, line and key.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use thiserror::Error;

use crate::bounded_read::{ReadError, excerpt, read_text};

mod diagnosis;
mod number;
mod places;
mod reference;
mod suggestion;

pub use diagnosis::{Diagnosis, Mistake, diagnose};
pub use number::{
    BallDiameter, CameraGain, CameraTime, Coordinate, DepthUnits, DistortionCoefficient,
    FocalLength, Hue, NumberError, PixelCoordinate, Range,
};
pub(crate) use number::{domain, pixels, rate, some_pixels};
pub use places::{Place, place};
pub use reference::{Key, keys};

/// Most bytes of a file. Parsing takes about 60 times as much memory.
pub const MAX_BYTES: u64 = 1 << 20;

/// Failure to read a TOML file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TomlFileError {
    /// The file cannot be read, or is too large.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The contents are invalid: a syntax error, an unknown key, a missing key or a value out of
    /// its range.
    #[error("{}", at_line(.path, *.line, .key, .message))]
    Content {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1. Of a missing key it is the line of its table's header, of a
        /// missing table the file's last line.
        line: usize,
        /// The key with its tables, `intrinsics.fx`. Empty where the mistake has no key.
        key: String,
        /// The mistake. For an unknown key with the nearest known one.
        message: String,
    },
}

/// Formats "FILE:LINE: in `KEY`: MISTAKE", which editors can jump to.
fn at_line(path: &Path, line: usize, key: &str, message: &str) -> String {
    match key {
        "" => format!("{}:{line}: {message}", path.display()),
        _ => format!("{}:{line}: in `{key}`: {message}", path.display()),
    }
}

/// Reads the TOML file at `path`, of at most [`MAX_BYTES`].
///
/// `T` and the types of its fields need `#[serde(deny_unknown_fields)]`. Values should be checked
/// when they are read (`#[serde(try_from = "...")]`, see [`quantities`](crate::quantities)), so
/// that their mistakes are reported with lines too.
///
/// # Errors
/// Where the file cannot be read, or its contents are invalid.
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, TomlFileError> {
    parse_toml(path, &read_text(path, MAX_BYTES)?)
}

/// Parses the text of the TOML file at `path`, as [`read_toml`]. The file is not read; errors name
/// it.
///
/// # Errors
/// Where the contents are invalid.
pub fn parse_toml<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, TomlFileError> {
    toml::from_str(text).map_err(|error| {
        let key = key_of(error.clone());
        let line = line_of(text, &error, &key);
        let mut message = error.message().replace('\n', " ");
        if key.is_empty() && !message.starts_with("missing field") {
            let quoted = excerpt(text.lines().nth(line - 1).unwrap_or_default().trim());
            message = format!("{message}: {quoted}");
        }
        if let Some(name) = suggestion::nearest(error.message()) {
            message.push_str(&format!("; did you mean `{name}`?"));
        }
        TomlFileError::Content { path: path.to_path_buf(), line, key, message }
    })
}

/// Returns the line (from 1) of a mistake. A table that is missing is reported at the file's end;
/// the crate `toml` reports it at the beginning.
fn line_of(text: &str, error: &toml::de::Error, key: &str) -> usize {
    let end = text.trim_end().len();
    let missing = key.is_empty() && error.message().starts_with("missing field");
    let start = match error.span() {
        Some(span) if !missing => span.start.min(text.len()),
        _ => end,
    };
    1 + text.as_bytes()[..start].iter().filter(|&&b| b == b'\n').count()
}

/// Returns the dotted key of an error. The crate `toml` states it only in the text of an error
/// without input, in the last line "in `a.b`".
fn key_of(mut error: toml::de::Error) -> String {
    error.set_input(None);
    let text = error.to_string();
    let last = text.trim_end().rsplit('\n').next().unwrap_or_default();
    last.strip_prefix("in `").and_then(|k| k.strip_suffix('`')).unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct File {
        rig: Rig,
        camera: Camera,
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Rig {
        gain: CameraTime,
        name: Option<String>,
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Camera {
        at: [Coordinate; 3],
    }

    fn error_of(text: &str) -> (usize, String, String) {
        match parse_toml::<File>(Path::new("rig.toml"), text) {
            Err(TomlFileError::Content { line, key, message, .. }) => (line, key, message),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_file_without_a_mistake_is_read() {
        let text = "[rig]\ngain = 2.5\nname = \"a\"\n[camera]\nat = [0, 1.5, -2]\n";
        let rig = Rig { gain: 2.5.try_into().unwrap(), name: Some("a".to_owned()) };
        let camera = Camera { at: [0.0, 1.5, -2.0].map(|x| Coordinate::try_from(x).unwrap()) };
        assert_eq!(parse_toml::<File>(Path::new("rig.toml"), text).unwrap(), File { rig, camera });
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
    fn an_unknown_key_is_reported_with_the_nearest_one() {
        let (line, _, message) = error_of("[rig]\ngian = 2\n");
        assert!(line == 2 && message.ends_with("; did you mean `gain`?"), "{message}");
        let (_, _, message) = error_of("[rig]\ncolour = 2\n");
        assert!(!message.contains("did you mean"), "{message}");
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
