//! Configuration files (TOML). Every mistake is reported with its file, line, key and value.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use crate::bounded_read::{ReadError, read_text};
use crate::mistake::Mistake;

pub use diagnosis::{Diagnosis, diagnose};

mod diagnosis;
mod mistake;

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
    #[error(
        "{}:{}: {mistake}{}{allowed}", .path.display(), mistake.line,
        if .allowed.is_empty() { "" } else { "; allowed: " }
    )]
    Content {
        /// The file.
        path: PathBuf,
        /// The mistake.
        mistake: Box<Mistake>,
        /// What is allowed; empty where that is not known.
        allowed: String,
    },
    /// The file is one of another kind.
    #[error("{}: this is {found}; give {wanted}", .path.display())]
    OtherKind {
        /// The file.
        path: PathBuf,
        /// What it is: "a camera file".
        found: &'static str,
        /// What is needed: "the rig file".
        wanted: &'static str,
    },
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
    let content = |mistake| TomlFileError::Content {
        path: path.to_path_buf(),
        mistake: Box::new(mistake),
        allowed: String::new(),
    };
    let (table, errors) = DeTable::parse_recoverable(text);
    if let Some(error) = errors.first() {
        return Err(content(Mistake::of_syntax(text, table.get_ref(), error)));
    }
    T::deserialize(Deserializer::from(table.clone()))
        .map_err(|error| content(Mistake::of_value(text, table.get_ref(), &error)))
}

/// Key with its tables, outermost first.
type KeyPath = Vec<String>;

/// Place of a key's value in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Number of the line, from 1.
    pub line: usize,
    /// Text of the value.
    pub value: String,
}

/// Returns the place of the dotted key `key` in the text of a file; `None` where the file does not
/// have it.
pub fn place(text: &str, key: &str) -> Option<Place> {
    let (table, _) = DeTable::parse_recoverable(text);
    let path: KeyPath = key.split('.').map(str::to_owned).collect();
    let span = find(table.get_ref(), &path)?.span();
    let written = text.get(span.clone()).unwrap_or_default();
    Some(Place { line: line_at(text, span.start), value: written.to_owned() })
}

/// Returns the value of the key `path`.
fn find<'a, 'i>(table: &'a DeTable<'i>, path: &[String]) -> Option<&'a Spanned<DeValue<'i>>> {
    let (first, rest) = path.split_first()?;
    let value = table.get(first.as_str())?;
    if rest.is_empty() { Some(value) } else { find(value.get_ref().as_table()?, rest) }
}

/// Returns the number of the line, from 1, of a byte of the text.
fn line_at(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|&b| b == b'\n').count()
}

/// Returns the key whose name or value is at `span`: the one with the smallest value around it.
fn key_at(table: &DeTable<'_>, span: &Range<usize>) -> KeyPath {
    let mut best = Candidate { size: usize::MAX, path: KeyPath::new() };
    search(table, span, &mut KeyPath::new(), &mut best);
    best.path
}

struct Candidate {
    /// Length of the value, bytes.
    size: usize,
    path: KeyPath,
}

fn search(table: &DeTable<'_>, span: &Range<usize>, path: &mut KeyPath, best: &mut Candidate) {
    for (key, value) in table {
        path.push(key.get_ref().to_string());
        let around = value.span();
        if key.span() == *span {
            *best = Candidate { size: 0, path: path.clone() };
        } else if around.start <= span.start && span.end <= around.end && around.len() < best.size {
            *best = Candidate { size: around.len(), path: path.clone() };
        }
        if let DeValue::Table(table) = value.get_ref() {
            search(table, span, path, best);
        }
        path.pop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mistake::Kind;
    use crate::quantity::{CameraTime, Coordinate};
    use serde::Deserialize;

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

    fn error_of(text: &str) -> Mistake {
        match parse_toml::<File>(Path::new("rig.toml"), text) {
            Err(TomlFileError::Content { mistake, .. }) => *mistake,
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
    fn a_mistake_is_named_with_line_key_and_value() {
        let end = "\n[camera]\nat = [0, 0, 0]\n";
        for (text, line, key, value) in [
            ("# 1\n[rig]\ngain = 1\ngian = 2", 4, "rig.gian", ""),
            ("# 1\n[rig]\nname = \"a\"\n", 2, "rig.gain", ""),
            ("# 1\n[rig]\ngain = -1.0", 3, "rig.gain", "-1.0"),
            ("[rig]\ngain = \"x\"", 2, "rig.gain", "\"x\""),
            ("[rig]\ngain = \"1 m\" # 2", 2, "rig.gain", "\"1 m\""),
            ("[rig]\ngain = 1\nname = { a = 1 }", 3, "rig.name", ""),
            ("[rig]\ngain = 1\n[motor]\nat = 1", 3, "motor", ""),
            // Errors of syntax.
            ("[rig]\ngain = 1\ngain = 2", 3, "", ""),
            ("[rig]\ngain 1", 2, "", ""),
            ("[rig]\ngain = 110,0   # b", 2, "rig.gain", ""),
            ("[rig]\ngain = 0.5 m", 2, "rig.gain", ""),
            ("[rig]\ngain = 1/16", 2, "rig.gain", ""),
            ("[rig]\ngain = fast", 2, "rig.gain", ""),
            ("[rig]\ngain = { a = 1 }\n[rig.gain.b]\nc = 1", 3, "", ""),
        ] {
            let found = error_of(&format!("{text}{end}"));
            assert_eq!((found.line, &*found.key, &*found.value), (line, key, value), "{found:?}");
        }
        for (at, value) in [
            ("[0, inf, 0]", "[0, inf, 0]"),
            ("[0, 0]", "[0, 0]"),
            ("[0,626, 0,27, 0,325]", "[0,626, 0,27, 0,325]"),
            ("[0.6; 0.2; 0.3]", ""),
        ] {
            let found = error_of(&format!("[rig]\ngain = 1\n[camera]\nat = {at}\n"));
            assert_eq!((found.line, &*found.key, &*found.value), (4, "camera.at", value));
        }
        let absent = error_of("[rig]\ngain = 1\n\n# end\n");
        assert_eq!((absent.line, &*absent.key, absent.kind), (4, "camera", Kind::Missing));
    }

    #[test]
    fn an_error_of_syntax_has_its_line_with_it() {
        let found = error_of("[rig]\ngain = fast # m/s\n").to_string();
        assert!(found.ends_with(": gain = fast # m/s"), "{found}");
    }

    #[test]
    fn an_empty_file_is_an_error_on_its_first_line() {
        let found = error_of("");
        assert_eq!((found.line, &*found.key), (1, "rig"));
    }

    #[test]
    fn a_long_line_is_not_quoted_whole() {
        let Mistake { line, message, .. } = error_of(&format!("\na = {}", "[".repeat(100_000)));
        assert!(line == 2 && message.len() < 400, "{line}: {message:.400}");
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

    const TEXT: &str = "\
targets = [[1, 2]]
[motors]
driver = { coils = { duty = 0.8 } }
[law.sign]
gain = 1
";

    #[test]
    fn the_place_of_a_key_is_its_line_and_its_value() {
        let found = |key| place(TEXT, key).map(|place| (place.line, place.value));
        assert_eq!(found("targets"), Some((1, "[[1, 2]]".to_owned())));
        assert_eq!(found("motors.driver.coils.duty"), Some((3, "0.8".to_owned())));
        assert_eq!(found("law.sign.gain"), Some((5, "1".to_owned())));
        for absent in ["motors.rate", "targets.x", "law.taut.mean"] {
            assert_eq!(found(absent), None);
        }
    }

    #[test]
    fn a_byte_belongs_to_the_innermost_value_around_it() {
        let table = DeTable::parse(TEXT).unwrap();
        let key = |word: &str| {
            let start = TEXT.find(word).unwrap();
            key_at(table.get_ref(), &(start..start + word.len())).join(".")
        };
        assert_eq!(key("0.8"), "motors.driver.coils.duty");
        assert_eq!(key("duty"), "motors.driver.coils.duty");
        assert_eq!(key("2]"), "targets");
        assert_eq!(key("gain"), "law.sign.gain");
    }
}
