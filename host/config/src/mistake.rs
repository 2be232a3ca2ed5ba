//! Mistakes in files that a person writes.

use std::fmt;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Mistake in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    /// Number of the line, from 1. Of a missing key it is the first line of its table, of a missing
    /// table the last line of the file.
    pub line: usize,
    /// The key with its tables, `intrinsics.fx`, or the name of a column; empty where it is not
    /// known.
    pub key: String,
    /// Text of the value. It is empty for a table, a missing key and an unknown key.
    pub value: String,
    /// Kind of the mistake.
    pub kind: Kind,
    /// Description of the reader, or of the type of the value.
    pub message: String,
}

/// Kind of a mistake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The text has not the form of such a file.
    Syntax,
    /// The file has no such key or column.
    Unknown,
    /// A key or a column that the file must have is not there.
    Missing,
    /// The value is of another type, or out of its range.
    Wrong,
}

impl Mistake {
    /// Returns the mistake of a line whose key is not known.
    pub fn of_line(line: usize, message: impl fmt::Display) -> Self {
        let (key, value) = (String::new(), String::new());
        Self { line, key, value, kind: Kind::Syntax, message: message.to_string() }
    }

    /// Returns what is wrong with the key, or with the line where the key is not known.
    pub fn problem(&self) -> String {
        match self.kind {
            Kind::Missing => "is missing".to_owned(),
            _ if self.key.is_empty() => self.message.clone(),
            _ => format!("is wrong: {}", self.message),
        }
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, value, .. } = self;
        match (key.as_str(), value.as_str()) {
            ("", _) => {}
            (_, "") => write!(f, "`{key}` ")?,
            _ => write!(f, "`{key} = {value}` ")?,
        }
        f.write_str(&self.problem())
    }
}

/// Mistakes in a file, one a line: `FILE:LINE: ...`.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{}", listed(path, mistakes))]
pub struct FileMistakes {
    /// The file.
    pub path: PathBuf,
    /// The mistakes, in the order of their lines.
    pub mistakes: Vec<Mistake>,
}

/// Number of mistakes that a message lists.
const MAX_LISTED: usize = 20;

/// Returns a line for each mistake, without those above [`MAX_LISTED`].
fn listed(path: &Path, mistakes: &[Mistake]) -> String {
    let path = path.display();
    let shown = mistakes.iter().take(MAX_LISTED);
    let mut lines: Vec<String> = shown.map(|it| format!("{path}:{}: {it}", it.line)).collect();
    if mistakes.len() > MAX_LISTED {
        lines.push(format!("{path}: mistakes not shown: {}", mistakes.len() - MAX_LISTED));
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_mistakes_are_listed_and_the_others_counted() {
        let mistakes = |count| (1..=count).map(|line| Mistake::of_line(line, "no place")).collect();
        let listed =
            |count| FileMistakes { path: "way.csv".into(), mistakes: mistakes(count) }.to_string();
        assert_eq!(listed(2), "way.csv:1: no place\nway.csv:2: no place");
        assert_eq!(listed(MAX_LISTED).lines().count(), MAX_LISTED);
        assert!(listed(60).ends_with("\nway.csv: mistakes not shown: 40"), "{}", listed(60));
    }
}
