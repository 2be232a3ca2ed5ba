//! Diagnosis of a TOML file: all mistakes at once.
//!
//! The crate `toml` reports one wrong value of a file. The diagnosis repairs that mistake with a
//! placeholder, or leaves the key out, and reads again.

#[cfg(test)]
mod tests;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::{KeyPath, find};
use crate::mistake::{Kind, Mistake};

/// Most repairs of a file.
const MAX_REPAIRS: usize = 100;

/// Most errors of syntax that are reported. Each is found in the text anew.
const MAX_SYNTAX_ERRORS: usize = 100;

/// Contents of a file and all its mistakes.
#[derive(Debug)]
pub struct Diagnosis<T> {
    /// Contents, with placeholders for what is wrong or missing; `None` where the syntax is wrong
    /// or the mistakes cannot be repaired.
    pub contents: Option<T>,
    /// All mistakes, in the order of their lines.
    pub mistakes: Vec<Mistake>,
}

/// Reads the text of a TOML file as [`parse_toml`](super::parse_toml), and returns all mistakes.
///
/// `placeholders` is a TOML text with a valid value for each required key.
pub fn diagnose<T: DeserializeOwned>(text: &str, placeholders: &str) -> Diagnosis<T> {
    let (table, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        let errors = errors.iter().take(MAX_SYNTAX_ERRORS);
        let mut mistakes: Vec<_> =
            errors.map(|error| Mistake::of_syntax(text, table.get_ref(), error)).collect();
        // Further errors in a line follow from its first.
        mistakes.sort_by_key(|mistake| mistake.line);
        mistakes.dedup_by_key(|mistake| mistake.line);
        return Diagnosis { contents: None, mistakes };
    }
    // Behind the text, so that a span says from which of the two a value is.
    let placeholders = format!("{}{placeholders}", "\n".repeat(text.len() + 1));
    let (placeholders, _) = DeTable::parse_recoverable(&placeholders);
    let placeholders = placeholders.into_inner();
    let mut repair = Repair { table, placeholders, repaired: Vec::new(), mistakes: Vec::new() };
    let mut contents = None;
    for _ in 0..MAX_REPAIRS {
        match T::deserialize(Deserializer::from(repair.table.clone())) {
            Ok(value) => {
                contents = Some(value);
                break;
            }
            Err(error) => {
                let mistake = Mistake::of_value(text, repair.table.get_ref(), &error);
                repair.repair(mistake);
            }
        }
    }
    repair.mistakes.sort_by_key(|mistake| mistake.line);
    Diagnosis { contents, mistakes: repair.mistakes }
}

/// File under repair.
struct Repair<'i> {
    table: Spanned<DeTable<'i>>,
    placeholders: DeTable<'i>,
    repaired: Vec<KeyPath>,
    mistakes: Vec<Mistake>,
}

impl Repair<'_> {
    /// Repairs the key of `mistake`, and adds it unless it follows from an earlier repair.
    fn repair(&mut self, mistake: Mistake) {
        let (kind, path) = (mistake.kind, mistake.path());
        let follows = self.repaired.iter().any(|p| p.starts_with(&path) || path.starts_with(p));
        if !follows {
            self.mistakes.push(mistake);
        }
        let placeholder = find(&self.placeholders, &path).filter(|_| !follows).cloned();
        match (kind, placeholder) {
            (Kind::Missing | Kind::Wrong, Some(value)) => {
                insert(self.table.get_mut(), &path, value)
            }
            // An optional table without a required key is left out.
            (Kind::Missing, None) => remove(self.table.get_mut(), &path[..path.len() - 1]),
            (_, _) => remove(self.table.get_mut(), &path),
        }
        self.repaired.push(path);
    }
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
