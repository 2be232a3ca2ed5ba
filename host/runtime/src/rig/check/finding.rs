//! Findings of a check, and the file that they are about.

use std::fmt;
use std::path::{Path, PathBuf};

use plumb_config::reference::{Key, keys};
use plumb_config::toml_file::{Mistake, place};
use serde::Serialize;

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
        let values = self.values.iter().map(|(key, value)| match value.as_str() {
            "" => format!("`{key}`"),
            _ => format!("`{key} = {value}`"),
        });
        let values = values.collect::<Vec<_>>().join(", ");
        let space = if values.is_empty() { "" } else { " " };
        write!(f, "{values}{space}{}", self.problem)?;
        if self.allowed.is_empty() { Ok(()) } else { write!(f, "; allowed: {}", self.allowed) }
    }
}

/// File under check, with its reference page.
pub(super) struct Document<'a> {
    path: &'a Path,
    text: &'a str,
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

    /// Returns the error of a mistake in the text.
    pub(super) fn mistake(&self, mistake: &Mistake) -> Finding {
        let key = &mistake.key;
        let named = !key.is_empty();
        // The keys of a table contradict each other: its header is no value.
        let is_header = mistake.value == format!("[{key}]");
        let value = if is_header { String::new() } else { mistake.value.clone() };
        // The message of a number names its range, after the number itself.
        let range = mistake.message.split_once(" must be ");
        let range = range.filter(|(number, _)| number.parse::<f64>().is_ok());
        let problem = range.map(|(_, range)| format!("must be {range}"));
        let allowed = self.allowed(key).filter(|_| !is_header && problem.is_none());
        Finding {
            severity: Severity::Error,
            file: self.path.to_owned(),
            line: mistake.line,
            values: named.then(|| (key.clone(), value)).into_iter().collect(),
            problem: problem.unwrap_or_else(|| mistake.message.clone()),
            allowed: allowed.unwrap_or_default(),
        }
    }

    /// Returns the range of a key with an example; `None` for an unknown key.
    fn allowed(&self, name: &str) -> Option<String> {
        let Some(key) = self.keys.iter().find(|key| key.name == name) else {
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
            value => format!(", for example `{name} = {value}`"),
        };
        Some(format!("{range}{unit}{example}"))
    }

    /// Returns the default of a key that the file does not have.
    fn default_of(&self, name: &str) -> String {
        let key = self.keys.iter().find(|key| key.name == name);
        key.map(|key| key.value.clone()).unwrap_or_default()
    }
}
