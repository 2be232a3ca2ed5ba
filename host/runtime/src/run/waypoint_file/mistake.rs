//! Mistakes in a file of waypoints.

use std::path::{Path, PathBuf};

use plumb_config::bounded_read::ReadError;
use plumb_path::table::{and_more, column_count, more_mistakes};
use thiserror::Error;

use crate::rig::MotionError;

/// Mistake in a file of waypoints.
#[derive(Debug, Error)]
pub enum WaypointError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file has no waypoints.
    #[error("{}: no waypoints; each line is x, y, z", .0.display())]
    Empty(PathBuf),
    /// The first line names other columns.
    #[error(
        "{}:{line}: the columns are '{found}', but must be x, y, z in metres, and may be dwell in \
         seconds and tolerance in metres: {wrong}",
        .path.display()
    )]
    Names {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The line.
        found: String,
        /// The columns that are wrong.
        wrong: String,
    },
    /// The file is one of another kind.
    #[error("{}: {is}", .path.display())]
    OtherKind {
        /// The file.
        path: PathBuf,
        /// What it is, and where it belongs.
        is: &'static str,
    },
    /// Lines of the file have mistakes.
    #[error("{}", listed(.path, .mistakes))]
    Mistakes {
        /// The file.
        path: PathBuf,
        /// The mistakes, in the order of the lines; at least one.
        mistakes: Vec<WaypointMistake>,
    },
}

/// Returns what is wrong with a line of so many columns, where no line names them.
fn unnamed(count: usize) -> String {
    match count {
        1 => "one column: separate x, y and z by commas".to_owned(),
        _ => format!(
            "{count} columns without names; 3 are x, y, z. For others the first line has the \
             names: x,y,z,dwell,tolerance"
        ),
    }
}

/// Mistake in a line of a file of waypoints.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum WaypointMistake {
    /// The line has too few or too many columns.
    #[error(
        "{line}: {}, but the first line names {most}{}",
        column_count(*.count),
        and_more(*.more, "line")
    )]
    Columns {
        /// Line, from 1.
        line: u64,
        /// Number of columns.
        count: usize,
        /// Number of columns that the first line names.
        most: usize,
        /// Number of further lines with as many columns.
        more: usize,
    },
    /// The line has other columns than x, y, z, and no line names them.
    #[error("{line}: {}{}", unnamed(*.count), and_more(*.more, "line"))]
    Unnamed {
        /// Line, from 1.
        line: u64,
        /// Number of columns.
        count: usize,
        /// Number of further lines with as many columns.
        more: usize,
    },
    /// The separators are wrong.
    #[error("{line}: {why}{}", and_more(*.more, "line"))]
    Separators {
        /// Line, from 1.
        line: u64,
        /// Reason, and what to do.
        why: String,
        /// Number of further lines like this one.
        more: usize,
    },
    /// A field is no number, or out of range.
    #[error("{line}: column {column} ({name}): '{value}': {why}")]
    Field {
        /// Line, from 1.
        line: u64,
        /// Column, from 1.
        column: usize,
        /// Name of the column.
        name: &'static str,
        /// The field.
        value: String,
        /// Reason.
        why: String,
    },
    /// The place is one that the rig does not allow.
    #[error("{line}: {target:?} m: {error}{}", and_more(*.more, "line"))]
    Place {
        /// Line, from 1.
        line: u64,
        /// Place, metres.
        target: [f64; 3],
        /// Broken rule.
        error: MotionError,
        /// Number of further places that are probably in the same unit.
        more: usize,
    },
}

impl WaypointMistake {
    /// Adds the mistake to `mistakes`, or counts it where one of them stands for all of its kind.
    pub(super) fn add_to(self, mistakes: &mut Vec<Self>) {
        match mistakes.iter_mut().find_map(|first| first.count_of(&self)) {
            Some(more) => *more += 1,
            None => mistakes.push(self),
        }
    }

    /// Returns the number of further mistakes for which this one stands, if `other` is one.
    fn count_of(&mut self, other: &Self) -> Option<&mut usize> {
        match (self, other) {
            (Self::Separators { more, .. }, Self::Separators { .. }) => Some(more),
            (Self::Columns { count, more, .. }, Self::Columns { count: other, .. })
            | (Self::Unnamed { count, more, .. }, Self::Unnamed { count: other, .. })
                if count == other =>
            {
                Some(more)
            }
            (Self::Place { error, more, .. }, Self::Place { error: other, .. })
                if error.other_unit().is_some() && error.other_unit() == other.other_unit() =>
            {
                Some(more)
            }
            _ => None,
        }
    }
}

/// Number of mistakes of a file that a message lists.
pub(super) const MAX_LISTED: usize = 20;

/// Returns a line for each mistake, without those above [`MAX_LISTED`].
fn listed(path: &Path, mistakes: &[WaypointMistake]) -> String {
    let shown = mistakes.iter().take(MAX_LISTED);
    let mut lines: Vec<String> =
        shown.map(|mistake| format!("{}:{mistake}", path.display())).collect();
    if let Some(more) = mistakes.len().checked_sub(MAX_LISTED).filter(|more| *more > 0) {
        lines.push(format!("{}: {}", path.display(), more_mistakes(more)));
    }
    lines.join("\n")
}
