//! Configuration files (TOML). Every mistake is reported with its file, line and key, and a
//! misspelt name with the most similar one.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde_path_to_error::Segment;
use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::bounded_read::{ReadError, excerpt, read_text};
use crate::misspelt::nearest;
use crate::type_words::in_words;

use lists::lists_with_commas;
use syntax::SyntaxMistake;

pub use diagnosis::{Diagnosis, Mistake, diagnose};
pub use items::{WrongItem, wrong_items};

mod brackets;
mod diagnosis;
mod items;
mod lists;
mod syntax;
mod values;

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
    let content = |line, key, message| TomlFileError::Content {
        path: path.to_path_buf(),
        line,
        key,
        message,
    };
    let quoted = |line: usize, message: String| {
        let quoted = excerpt(text.lines().nth(line - 1).unwrap_or_default().trim());
        format!("{message}: {quoted}")
    };
    let table = DeTable::parse(text).map_err(|error| {
        let SyntaxMistake { line, key, value, message } = SyntaxMistake::first(text, &error);
        let message = match (key.as_str(), value.as_str()) {
            ("", _) => quoted(line, message),
            (_, "") => message,
            _ => format!("{value} {message}"),
        };
        content(line, key, message)
    })?;
    if let Some(list) = lists_with_commas(text, table.get_ref()).into_iter().next() {
        return Err(content(list.line, list.key, list.message));
    }
    deserialize(&table).map_err(|(key, error)| {
        let line = line_of(text, &error, &key);
        let mut message = in_words(&one_line(error.message()));
        if key.is_empty() && !message.starts_with("missing field") {
            message = quoted(line, message);
        }
        if let Some(name) = expected_name(error.message()) {
            message.push_str(&format!("; did you mean `{name}`?"));
        }
        content(line, key, message)
    })
}

/// Returns a message in one line.
fn one_line(message: &str) -> String {
    message.replace('\n', " ")
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

/// Deserializes the contents of a TOML file. An error comes with the dotted key of its value; of an
/// unknown key, with that of its table.
fn deserialize<T: DeserializeOwned>(
    table: &Spanned<DeTable<'_>>,
) -> Result<T, (String, toml::de::Error)> {
    let deserializer = toml::Deserializer::from(table.clone());
    serde_path_to_error::deserialize(deserializer).map_err(|error| {
        let mut names: Vec<&str> = error.path().iter().filter_map(name_of).collect();
        if error.inner().message().starts_with("unknown field") {
            names.pop();
        }
        (names.join("."), error.into_inner())
    })
}

/// Returns the name of a segment of a path; `None` for a place in an array.
fn name_of(segment: &Segment) -> Option<&str> {
    match segment {
        Segment::Map { key: name } | Segment::Enum { variant: name } => Some(name),
        Segment::Seq { .. } | Segment::Unknown => None,
    }
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
    let mut names = key.split('.');
    let mut value = table.get_ref().get(names.next()?)?;
    for name in names {
        value = value.get_ref().as_table()?.get(name)?;
    }
    let span = value.span();
    let written = text.get(span.clone()).unwrap_or_default();
    Some(Place { line: line_at(text, span.start), value: written.to_owned() })
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

/// Returns the name that `message` of the crate `toml` most probably means: of "unknown field
/// `gian`, expected one of `gain`, `name`" it is `gain`. `None` where no expected name is similar.
fn expected_name(message: &str) -> Option<&str> {
    if !message.starts_with("unknown field") && !message.starts_with("unknown variant") {
        return None;
    }
    // The text between each pair of backquotes.
    let mut names = message.split('`').skip(1).step_by(2);
    nearest(names.next()?, names)
}

#[cfg(test)]
mod tests {
    use super::*;
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
    fn decimal_commas_are_named_with_what_to_write() {
        let message = |text: &str| {
            let (line, key, message) = error_of(text);
            format!("{line} {key}: {message}")
        };
        let point = "must have a decimal point: write";
        let number = message("[rig]\n# a\ngain = 110,0   # b\n[camera]\nat = [0, 0, 0]\n");
        assert_eq!(number, format!("3 rig.gain: 110,0 {point} 110.0"));
        let inline = message("a = { b = 1, c = -0,5 }\n");
        assert_eq!(inline, format!("1 a.c: -0,5 {point} -0.5"));
        let commas = "has commas as the decimal sign and between its numbers: write points, ";
        let list = |list: &str| message(&format!("[rig]\ngain = 1\n[camera]\nat = {list}\n"));
        let expected = format!("4 camera.at: {commas}[0.626, 0.27, 0.325]");
        assert_eq!(list("[0,626, 0,27, 0,325]"), expected);
        assert_eq!(list("[0,6, 0,2, 0,3]"), format!("4 camera.at: {commas}[0.6, 0.2, 0.3]"));
        assert_eq!(list("[0,6, 1, 0,3]"), format!("4 camera.at: {commas}as in [0.4, 0.5, 0.2]"));
        // TOML has no whole numbers that begin with a zero.
        let zero = list("[0,62, 0,05, 0,3]");
        assert_eq!(zero, format!("4 camera.at: {commas}[0.62, 0.05, 0.3]"));
        let places = list("[[0,62, 0,05, 0,3], [0,5, 0,2, 0,3]]");
        assert!(places.ends_with(", [[0.62, 0.05, 0.3], [0.5, 0.2, 0.3]]"), "{places}");
        let twice = message("[rig]\ngain = { a = 1 }\n[rig.gain.b]\nc = 1\n");
        let value = "line 2 sets `rig.gain`. Remove that line, or write these keys into its braces";
        assert_eq!(twice, format!("3 rig.gain.b: is there twice: {value}"));
        let open = message("[rig]\ngain = 1\n[camera\nat = 1\n");
        assert_eq!(open, "3 [camera: is not closed: a `]` is missing");
        for other in ["[626, 27, 325]", "[0.6, 0.2]"] {
            assert!(!list(other).contains("commas"), "{}", list(other));
        }
    }

    #[test]
    fn a_key_that_is_there_twice_and_a_type_are_named_in_words() {
        let (line, key, message) = error_of("[rig]\ngain = 1\ngain = 2\n");
        assert_eq!((line, key.as_str()), (3, "rig.gain"), "{message}");
        assert_eq!(message, "is there twice: remove one of the two");
        let (_, key, _) = error_of("[rig]\n[camera]\n[rig]\n");
        assert_eq!(key, "rig");
        let (_, _, message) = error_of("[rig]\ngain = 'x'\n[camera]\nat = [0, 0, 0]\n");
        assert!(message.ends_with("expected a number"), "{message}");
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

    #[test]
    fn a_similar_name_is_suggested() {
        let cases = [
            ("unknown field `gian`, expected `gain` or `name`", Some("gain")),
            ("unknown field `diameter`, expected `diameter_m` or `hue`", Some("diameter_m")),
            ("unknown variant `TMC2209`, expected `a4988` or `tmc2209`", Some("tmc2209")),
            ("unknown variant `opnni`, expected one of `simulated`, `openni`", Some("openni")),
            ("unknown field `k1`, expected one of `fx`, `fy`, `cx`, `cy`", None),
            ("unknown field `motor`, expected `rig` or `camera`", None),
            ("unknown field `x`, there are no fields", None),
            ("missing field `gain`", None),
        ];
        for (message, name) in cases {
            assert_eq!(expected_name(message), name, "{message}");
        }
    }
}
