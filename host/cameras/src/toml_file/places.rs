//! Places of keys in the text of a TOML file.

use std::ops::Range;

use toml::de::{DeTable, DeValue};

/// Key with its tables, outermost first.
pub(super) type Path = Vec<String>;

/// Place of a key's value in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Number of the line, from 1.
    pub line: usize,
    /// Value as it is written.
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
pub(super) fn line_at(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|&b| b == b'\n').count()
}

/// Returns the key whose name or value is at `span`: the one with the smallest value around it.
pub(super) fn key_at(table: &DeTable<'_>, span: &Range<usize>) -> Path {
    let mut best = Candidate { size: usize::MAX, path: Path::new() };
    search(table, span, &mut Path::new(), &mut best);
    best.path
}

struct Candidate {
    /// Length of the value, bytes.
    size: usize,
    path: Path,
}

fn search(table: &DeTable<'_>, span: &Range<usize>, path: &mut Path, best: &mut Candidate) {
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
