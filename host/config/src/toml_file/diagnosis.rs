//! Diagnosis of a TOML file: all mistakes at once.
//!
//! The crate `toml` reports one mistake of a file. The diagnosis repairs that mistake with a
//! placeholder, or leaves the key out, and reads again.

#[cfg(test)]
mod tests;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer, Error};

use super::brackets::unclosed;
use super::lists::lists_with_commas;
use super::syntax::SyntaxMistake;
use super::{KeyPath, expected_name, key_at, line_at, one_line};
use crate::type_words::in_words;

/// Most repairs of a file.
const MAX_REPAIRS: usize = 100;

/// Mistake in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    /// Number of the line, from 1; `None` for a key that is missing in the whole file.
    pub line: Option<usize>,
    /// The key with its tables; empty for an error of syntax.
    pub key: String,
    /// The value as it is written; empty for a missing or unknown key.
    pub value: String,
    /// Description.
    pub message: String,
    /// Whether the mistake hides others: the file is not read any further.
    pub hides_others: bool,
}

/// Contents of a file and all its mistakes.
#[derive(Debug)]
pub struct Diagnosis<T> {
    /// Contents, with placeholders for what is wrong or missing; `None` where the syntax is wrong
    /// or the mistakes cannot be repaired.
    pub contents: Option<T>,
    /// All mistakes, in the order of their lines.
    pub mistakes: Vec<Mistake>,
    /// Keys that misspelt ones stand for: `contents` has placeholders for them.
    pub meant: Vec<String>,
}

/// Reads the text of a TOML file as [`parse_toml`](super::parse_toml), and returns all mistakes.
///
/// `placeholders` is a TOML text with a valid value for each required key.
pub fn diagnose<T: DeserializeOwned>(text: &str, placeholders: &str) -> Diagnosis<T> {
    let (table, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        let mistakes = syntax_mistakes(text, &errors);
        return Diagnosis { contents: None, mistakes, meant: Vec::new() };
    }
    let lists = lists_with_commas(text, table.get_ref());
    // Behind the text, so that a span says from which of the two a value is.
    let placeholders = format!("{}{placeholders}", "\n".repeat(text.len() + 1));
    let (placeholders, _) = DeTable::parse_recoverable(&placeholders);
    let mut repair = Repair {
        text,
        table,
        placeholders: placeholders.into_inner(),
        repaired: Vec::new(),
        mistakes: Vec::new(),
        meant: Vec::new(),
    };
    let mut contents = None;
    for _ in 0..MAX_REPAIRS {
        match T::deserialize(Deserializer::from(repair.table.clone())) {
            Ok(value) => {
                contents = Some(value);
                break;
            }
            Err(error) => repair.repair(&error),
        }
    }
    // A misspelt key is one mistake, and not a missing key too.
    let meant = repair.meant;
    repair.mistakes.retain(|mistake| mistake.message != MISSING || !meant.contains(&mistake.key));
    for list in lists {
        repair.mistakes.retain(|mistake| mistake.key != list.key);
        repair.mistakes.push(list.into());
    }
    repair.mistakes.sort_by_key(|mistake| mistake.line);
    Diagnosis { contents, mistakes: repair.mistakes, meant }
}

fn syntax_mistakes(text: &str, errors: &[Error]) -> Vec<Mistake> {
    let mistakes = errors.iter().map(|error| SyntaxMistake::of(text, error).into());
    let mut mistakes: Vec<Mistake> = mistakes.collect();
    if let Some(bracket) = unclosed(text) {
        // What stands behind an open bracket is read as its contents.
        mistakes.retain(|mistake| mistake.line < Some(bracket.line));
        mistakes.push(bracket.into());
    }
    // Further errors in a line follow from its first, and other lines of a list have the same one.
    mistakes.sort_by_key(|mistake| mistake.line);
    mistakes.dedup_by(|later, first| {
        later.line == first.line || (later.key == first.key && later.message.contains(": for "))
    });
    mistakes.iter_mut().for_each(|mistake| mistake.hides_others = true);
    mistakes
}

impl From<SyntaxMistake> for Mistake {
    fn from(mistake: SyntaxMistake) -> Self {
        let SyntaxMistake { line, key, value, message } = mistake;
        Self { line: Some(line), key, value, message, hides_others: false }
    }
}

/// Message about a key that is missing.
const MISSING: &str = "is missing";

/// Kind of a mistake.
enum Kind {
    Unknown,
    Missing,
    Wrong,
}

/// File under repair.
struct Repair<'i> {
    text: &'i str,
    table: Spanned<DeTable<'i>>,
    placeholders: DeTable<'i>,
    repaired: Vec<KeyPath>,
    mistakes: Vec<Mistake>,
    /// Keys that unknown ones stand for.
    meant: Vec<String>,
}

impl Repair<'_> {
    /// Repairs the key of `error`, and adds the mistake unless it follows from an earlier repair.
    fn repair(&mut self, error: &Error) {
        let span = error.span().unwrap_or_default();
        let (kind, path) = self.classify(error, key_at(self.table.get_ref(), &span));
        let follows = self.repaired.iter().any(|p| p.starts_with(&path) || path.starts_with(p));
        if !follows {
            let mistake = self.mistake(error, &kind, &path);
            self.mistakes.push(mistake);
            if let (Kind::Unknown, Some(name)) = (&kind, expected_name(error.message())) {
                let tables = &path[..path.len().saturating_sub(1)];
                self.meant.push([tables, &[name.to_owned()]].concat().join("."));
            }
        }
        let placeholder = find(&self.placeholders, &path).filter(|_| !follows).cloned();
        match (kind, placeholder) {
            (Kind::Missing | Kind::Wrong, Some(value)) => {
                insert(self.table.get_mut(), &path, value)
            }
            // An optional table without a required key is left out.
            (Kind::Missing, None) => remove(self.table.get_mut(), &path[..path.len() - 1]),
            (Kind::Unknown | Kind::Wrong, _) => remove(self.table.get_mut(), &path),
        }
        self.repaired.push(path);
    }

    /// Returns the kind of the mistake and the whole path of its key, where `path` is the innermost
    /// key around the place of the error.
    fn classify(&self, error: &Error, mut path: KeyPath) -> (Kind, KeyPath) {
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

    fn mistake(&self, error: &Error, kind: &Kind, path: &KeyPath) -> Mistake {
        let span = error.span().unwrap_or_default();
        let is_whole_file = matches!(kind, Kind::Missing) && path.len() == 1;
        let value = find(self.table.get_ref(), path).map(Spanned::span).unwrap_or_default();
        let value = self.text.get(value).unwrap_or_default();
        let (value, message) = match kind {
            Kind::Unknown => {
                let line = self.text.lines().nth(line_at(self.text, span.start) - 1);
                let twice = line.and_then(|line| table_again(line, path));
                ("", twice.unwrap_or_else(|| unknown(error.message())))
            }
            Kind::Missing => ("", MISSING.to_owned()),
            Kind::Wrong => (value, wrong(error.message())),
        };
        Mistake {
            line: (!is_whole_file).then(|| line_at(self.text, span.start)),
            key: path.join("."),
            value: value.to_owned(),
            message,
            hides_others: false,
        }
    }
}

/// Returns the message about a line, with the unknown key `path`, whose key begins with the name of
/// the table that it is in: `board.kind = "pico"` below `[board]`. `None` for other keys.
fn table_again(line: &str, path: &[String]) -> Option<String> {
    let table = path.split_last()?.1.join(".");
    let (key, _) = line.split_once('=')?;
    let own = key.trim().strip_prefix(&table)?.strip_prefix('.')?;
    (!table.is_empty()).then(|| format!("is no key of this file: write `{own}` below [{table}]"))
}

/// Returns the message about an unknown key, where `message` is that of the crate `toml`.
fn unknown(message: &str) -> String {
    match expected_name(message) {
        Some(name) => format!("is no key of this file; did you mean `{name}`?"),
        None => "is no key of this file: remove it, or write the line [TABLE] of its own table \
                 above it"
            .to_owned(),
    }
}

/// Returns the message about a wrong value, where `message` is that of the crate `toml`.
fn wrong(message: &str) -> String {
    let line = in_words(&one_line(message));
    match expected_name(message) {
        Some(name) => format!("{line}; did you mean `{name}`?"),
        None => line,
    }
}

fn find<'a, 'i>(table: &'a DeTable<'i>, path: &[String]) -> Option<&'a Spanned<DeValue<'i>>> {
    let (first, rest) = path.split_first()?;
    let value = table.get(first.as_str())?;
    if rest.is_empty() { Some(value) } else { find(value.get_ref().as_table()?, rest) }
}

/// Returns the table of the last name of `path`.
fn parent<'a, 'i>(table: &'a mut DeTable<'i>, path: &[String]) -> Option<&'a mut DeTable<'i>> {
    let Some((first, rest)) = path.split_first() else { return Some(table) };
    if rest.is_empty() {
        return Some(table);
    }
    match table.get_mut(first.as_str())?.get_mut() {
        DeValue::Table(table) => parent(table, rest),
        _ => None,
    }
}

fn remove(table: &mut DeTable<'_>, path: &[String]) {
    if let (Some(name), Some(table)) = (path.last(), parent(table, path)) {
        table.remove(name.as_str());
    }
}

fn insert<'i>(table: &mut DeTable<'i>, path: &[String], value: Spanned<DeValue<'i>>) {
    remove(table, path);
    if let (Some(name), Some(table)) = (path.last(), parent(table, path)) {
        let span = value.span();
        table.insert(Spanned::new(span, name.clone().into()), value);
    }
}
