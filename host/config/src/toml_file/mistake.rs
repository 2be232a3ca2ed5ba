//! Mistakes in a TOML file, from the errors of the crate `toml`.

use toml::Spanned;
use toml::de::{DeTable, DeValue, Error};

use super::{KeyPath, find, key_at, line_at};
use crate::bounded_read::excerpt;
use crate::mistake::{Kind, Mistake};

impl Mistake {
    /// Returns the key with its tables, outermost first.
    pub(super) fn path(&self) -> KeyPath {
        self.key.split('.').map(str::to_owned).collect()
    }

    /// Returns the mistake of an error of syntax; `table` is what could be read.
    pub(super) fn of_syntax(text: &str, table: &DeTable<'_>, error: &Error) -> Self {
        let span = error.span().unwrap_or_default();
        let line = line_at(text, span.start);
        let written = excerpt(text.lines().nth(line - 1).unwrap_or_default().trim());
        let key = key_at(table, &span);
        Self {
            line,
            key: value_of(table, &key).map(|_| key.join(".")).unwrap_or_default(),
            value: String::new(),
            kind: Kind::Syntax,
            message: format!("{}: {written}", one_line(error.message())),
        }
    }

    /// Returns the mistake of a value of `table`, or of a key.
    pub(super) fn of_value(text: &str, table: &DeTable<'_>, error: &Error) -> Self {
        // A table that is missing in the file has no span, or that of the file's first byte.
        let span = error.span().filter(|span| !span.is_empty());
        let around = span.as_ref().map(|span| key_at(table, span)).unwrap_or_default();
        let (kind, path) = classify(error, around);
        let place = span.map_or(text.trim_end().len(), |span| span.start);
        Self {
            line: line_at(text, place),
            key: path.join("."),
            value: written(text, table, kind, &path),
            kind,
            message: one_line(error.message()),
        }
    }
}

/// Returns the kind of a mistake and the whole path of its key, where `path` is the innermost key
/// around the place of the error. The crate `serde` tells both by the beginning of its messages.
fn classify(error: &Error, mut path: KeyPath) -> (Kind, KeyPath) {
    let message = error.message();
    if message.starts_with("unknown field") || message.starts_with("unexpected keys") {
        return (Kind::Unknown, path);
    }
    if let Some(field) = message.strip_prefix("missing field `") {
        path.push(field.trim_end_matches('`').to_owned());
        return (Kind::Missing, path);
    }
    (Kind::Wrong, path)
}

/// Returns the text of a wrong value; nothing for a table.
fn written(text: &str, table: &DeTable<'_>, kind: Kind, path: &KeyPath) -> String {
    let value = value_of(table, path).filter(|_| kind == Kind::Wrong);
    value.and_then(|value| text.get(value.span())).unwrap_or_default().to_owned()
}

/// Returns the value of a key; `None` for a table.
fn value_of<'a, 'i>(table: &'a DeTable<'i>, path: &KeyPath) -> Option<&'a Spanned<DeValue<'i>>> {
    find(table, path).filter(|value| !matches!(value.get_ref(), DeValue::Table(_)))
}

/// Returns a message in one line.
fn one_line(message: &str) -> String {
    message.replace('\n', " ")
}
