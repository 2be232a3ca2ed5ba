//! Findings about a file that a person wrote, in the words of its reference page.

use std::fmt;
use std::path::{Path, PathBuf};

use plumb_config::mistake::{Kind, Mistake};
use plumb_config::reference::{Key, keys};
use plumb_config::toml_file::place;
use serde::Serialize;

/// What follows a mistake of syntax.
pub(super) const HIDDEN: &str = "; other mistakes show when the syntax is right";

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// A run with this file is refused.
    Error,
    /// A run with this file starts, but the rig is badly protected or moves badly.
    Warning,
}

/// Finding of a check: a key, its value, what is wrong, and what is allowed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Severity.
    pub severity: Severity,
    /// The file.
    pub file: PathBuf,
    /// Number of the line, from 1; `None` for a key that the file does not have.
    pub line: Option<usize>,
    /// The keys with their tables and values, as they are written; none for an error of syntax.
    pub values: Vec<(String, String)>,
    /// What is wrong.
    pub problem: String,
    /// What is allowed, and an example; empty where the problem says so.
    pub allowed: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        f.write_str(match self.severity {
            Severity::Error => ": error: ",
            Severity::Warning => ": warning: ",
        })?;
        f.write_str(&self.explanation())
    }
}

impl Finding {
    /// Returns the keys with their values, what is wrong with them, and what is allowed.
    pub(super) fn explanation(&self) -> String {
        let values = self.values.iter().map(|(key, value)| match value.as_str() {
            "" => format!("`{key}`"),
            _ => format!("`{key} = {value}`"),
        });
        let values = values.collect::<Vec<_>>().join(", ");
        let space = if values.is_empty() { "" } else { " " };
        let allowed = match self.allowed.as_str() {
            "" => String::new(),
            allowed => format!("; allowed: {allowed}"),
        };
        format!("{values}{space}{}{allowed}", self.problem)
    }
}

/// File under check, with its reference page.
pub(super) struct Document<'a> {
    path: &'a Path,
    pub(super) text: &'a str,
    keys: Vec<Key>,
}

impl<'a> Document<'a> {
    /// Returns the file at `path` with this text. `page` is the reference page of its format.
    pub(super) fn new(path: &'a Path, text: &'a str, page: &str) -> Self {
        Self { path, text, keys: keys(page) }
    }

    /// Returns a finding about `names`, the first of which gives the line.
    pub(super) fn finding(
        &self,
        severity: Severity,
        names: &[&str],
        problem: impl Into<String>,
    ) -> Finding {
        let places: Vec<_> = names.iter().map(|name| place(self.text, name)).collect();
        let values = names.iter().zip(&places).map(|(name, place)| {
            let value = place.as_ref().map(|place| place.value.clone());
            ((*name).to_owned(), value.unwrap_or_else(|| self.default_of(name)))
        });
        Finding {
            severity,
            file: self.path.to_owned(),
            line: places.iter().flatten().map(|place| place.line).next(),
            values: values.collect(),
            problem: problem.into(),
            allowed: String::new(),
        }
    }

    /// Returns the error of values out of range, with their ranges.
    pub(super) fn out_of_range(&self, names: &[&str], problem: impl Into<String>) -> Finding {
        let allowed = names.iter().filter_map(|name| self.allowed(name));
        let allowed = allowed.collect::<Vec<_>>().join("; ");
        Finding { allowed, ..self.finding(Severity::Error, names, problem) }
    }

    /// Returns the errors of all mistakes in the text. The last one says where others are hidden.
    pub(super) fn mistakes(&self, mistakes: &[Mistake]) -> Vec<Finding> {
        let mut findings: Vec<Finding> = mistakes.iter().map(|it| self.mistake(it)).collect();
        let hides_others = mistakes.iter().any(|mistake| mistake.kind == Kind::Syntax);
        if let Some(last) = findings.last_mut().filter(|_| hides_others) {
            last.problem.push_str(HIDDEN);
        }
        findings
    }

    /// Returns the error of a mistake in the text.
    pub(super) fn mistake(&self, mistake: &Mistake) -> Finding {
        let Mistake { line, key, value, kind, .. } = mistake;
        let is_of_table = *kind == Kind::Wrong && value.is_empty();
        let allowed = self.allowed(key).filter(|_| *kind != Kind::Unknown && !is_of_table);
        Finding {
            severity: Severity::Error,
            file: self.path.to_owned(),
            line: Some(*line),
            values: (!key.is_empty()).then(|| (key.clone(), value.clone())).into_iter().collect(),
            problem: mistake.problem(),
            allowed: allowed.unwrap_or_default(),
        }
    }

    /// Returns the description of a key in the reference page; `None` for an unknown key.
    fn key(&self, name: &str) -> Option<&Key> {
        self.keys.iter().find(|key| key.name == name)
    }

    /// Returns the range of a key with an example; `None` for an unknown key.
    fn allowed(&self, name: &str) -> Option<String> {
        let Some(key) = self.key(name) else {
            let table = format!("{name}.");
            let is_table = self.keys.iter().any(|key| key.name.starts_with(&table));
            return is_table.then(|| format!("a table, [{name}] with its keys below it"));
        };
        let unit = match key.unit.as_str() {
            "" | "1" => String::new(),
            unit => format!(" ({unit})"),
        };
        let range = if key.range.is_empty() { &key.meaning } else { &key.range };
        let example = match key.value.as_str() {
            "" => String::new(),
            value => format!(", for example {value}"),
        };
        Some(format!("{range}{unit}{example}"))
    }

    /// Returns the default of a key that the file does not have.
    pub(super) fn default_of(&self, name: &str) -> String {
        self.key(name).map(|key| key.value.clone()).unwrap_or_default()
    }
}
