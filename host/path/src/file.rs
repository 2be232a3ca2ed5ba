//! Paths from files: CSV, or G-code ([`CodeMistake`] lists its words).
//!
//! The first line of a CSV file names the columns, in any order: `x,y,z` for waypoints, or
//! `t,x,y,z` for places with time stamps; metres in the rig frame, and seconds. A line that is
//! repeated is a pause.

use std::fmt::Display;
use std::mem::{Discriminant, discriminant};

use nalgebra::Point3;
use thiserror::Error;

use crate::gcode;
use crate::table::{
    self, Table, and_more, column_count, is_time, more_mistakes, places_of, wrong_names,
};
use crate::trajectory::{MAX_COORDINATE_M, Sample};

pub use crate::gcode::{CodeMistake, CodeProblem, is_gcode};

/// Contents of a file.
#[derive(Debug, Clone, PartialEq)]
pub enum PathFile {
    /// Waypoints.
    Waypoints {
        /// The places, metres.
        places: Vec<Point3<f64>>,
        /// Speed from each place to the next, m/s, infinite where the file has none; empty for a
        /// CSV file.
        speeds: Vec<f64>,
        /// Line of each place, from 1.
        lines: Vec<u64>,
    },
    /// Places with time stamps.
    Samples {
        /// The places with their times.
        samples: Vec<Sample>,
        /// Line of each place, from 1.
        lines: Vec<u64>,
    },
}

impl PathFile {
    /// Returns the places, metres, each with its line, from 1.
    pub fn places(&self) -> Vec<(u64, Point3<f64>)> {
        let (places, lines): (Vec<_>, _) = match self {
            Self::Waypoints { places, lines, .. } => (places.clone(), lines),
            Self::Samples { samples, lines } => {
                (samples.iter().map(|sample| sample.position).collect(), lines)
            }
        };
        lines.iter().copied().zip(places).collect()
    }
}

/// Mistakes in the text of a file. Their text begins with the number of the line;
/// [`in_file`](Self::in_file) returns it with the name of the file before it.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PathFileError {
    /// The first line does not name the columns.
    #[error(
        "{line}: the columns are '{found}', but must be 'x,y,z' (waypoints, metres) or \
         't,x,y,z' (with times, seconds){wrong}"
    )]
    Header {
        /// Line, from 1.
        line: u64,
        /// The line.
        found: String,
        /// End of the message: the columns that are wrong; empty where the line has no names.
        wrong: String,
    },
    /// The file has no line below the header.
    #[error("no places; the first line names the columns, x,y,z or t,x,y,z, each other is a place")]
    Empty,
    /// Lines have mistakes.
    #[error("{}", listed("", .0))]
    Lines(Vec<LineMistake>),
    /// Lines of G-code have mistakes.
    #[error("{}", listed("", .0))]
    Code(Vec<CodeMistake>),
    /// G-code has no motion.
    #[error("no places: this is G-code without G0 or G1 to a place of which X, Y and Z are known")]
    NoMotion,
}

impl PathFileError {
    /// Returns the mistakes as those of the file `name`: `NAME:LINE: ...`.
    pub fn in_file(&self, name: impl Display) -> String {
        match self {
            Self::Header { .. } => format!("{name}:{self}"),
            Self::Empty | Self::NoMotion => format!("{name}: {self}"),
            Self::Lines(mistakes) => listed(&format!("{name}:"), mistakes),
            Self::Code(mistakes) => listed(&format!("{name}:"), mistakes),
        }
    }
}

/// Mistake in a line.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LineMistake {
    /// The line has too few or too many columns.
    #[error(
        "{line}: {}, but the first line names {expected}{}",
        column_count(*.count),
        and_more(*.more, "line")
    )]
    Columns {
        /// Line, from 1.
        line: u64,
        /// Number of columns.
        count: usize,
        /// Number of columns of the header.
        expected: usize,
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
    /// A field is no finite number.
    #[error("{line}: column {name}: '{value}': must be a number")]
    Field {
        /// Line, from 1.
        line: u64,
        /// Name of the column.
        name: &'static str,
        /// The field.
        value: String,
    },
    /// A coordinate is far out of range.
    #[error(
        "{line}: column {name}: {value} m is out of range, ±{MAX_COORDINATE_M} (metres); are \
         these millimetres?{}",
        and_more(*.more, "number")
    )]
    Range {
        /// Line, from 1.
        line: u64,
        /// Name of the column.
        name: &'static str,
        /// Coordinate, metres.
        value: f64,
        /// Number of further coordinates out of range.
        more: usize,
    },
    /// The time is not above that of the line before.
    #[error("{line}: the time {time} s is not above that of the line before")]
    TimeNotRising {
        /// Line, from 1.
        line: u64,
        /// Time, seconds.
        time: f64,
    },
}

impl LineMistake {
    /// Returns the number of further mistakes that one mistake of this kind stands for; `None` for
    /// a kind of which each is listed.
    fn more(&mut self) -> Option<&mut usize> {
        match self {
            Self::Columns { more, .. }
            | Self::Separators { more, .. }
            | Self::Range { more, .. } => Some(more),
            _ => None,
        }
    }

    /// Returns what mistakes of one kind share: the variant, and a wrong number of columns.
    fn kind(&self) -> (Discriminant<Self>, usize) {
        let count = if let Self::Columns { count, .. } = self { *count } else { 0 };
        (discriminant(self), count)
    }

    /// Adds the mistake to `mistakes`, or counts it where one of its kind is there for all.
    fn add_to(mut self, mistakes: &mut Vec<Self>) {
        let kind = self.kind();
        let is_for_all = self.more().is_some();
        let first = mistakes.iter_mut().find(|it| is_for_all && it.kind() == kind);
        match first.and_then(Self::more) {
            Some(more) => *more += 1,
            None => mistakes.push(self),
        }
    }
}

/// Number of mistakes that a message lists.
const MAX_LISTED: usize = 20;

/// Returns a line for each mistake, behind `prefix`, without those above [`MAX_LISTED`].
fn listed<M: Display>(prefix: &str, mistakes: &[M]) -> String {
    let first = mistakes.iter().take(MAX_LISTED);
    let mut lines: Vec<String> = first.map(|mistake| format!("{prefix}{mistake}")).collect();
    if let Some(more) = mistakes.len().checked_sub(MAX_LISTED).filter(|more| *more > 0) {
        let more = more_mistakes(more);
        lines.push(if prefix.is_empty() { more } else { format!("{prefix} {more}") });
    }
    lines.join("\n")
}

/// Kind of a file, by its columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Places,
    Timed,
}

impl Kind {
    /// All kinds.
    const ALL: [Self; 2] = [Self::Places, Self::Timed];

    fn names(self) -> &'static [&'static str] {
        match self {
            Self::Places => &["x", "y", "z"],
            Self::Timed => &["t", "x", "y", "z"],
        }
    }
}

/// Columns of a file.
#[derive(Debug)]
struct Columns {
    kind: Kind,
    /// Each column by its place in the names of the kind.
    places: Vec<usize>,
}

impl Columns {
    /// Returns the columns that a line of names has, in any order; `None` where they are others.
    fn named(names: &[String]) -> Option<Self> {
        Kind::ALL.into_iter().find_map(|kind| {
            let known = kind.names();
            Some(Self { kind, places: places_of(names, known, known.len())? })
        })
    }

    /// Returns the columns of a file of places without names.
    fn unnamed() -> Self {
        Self { kind: Kind::Places, places: (0..Kind::Places.names().len()).collect() }
    }
}

/// Line of a file.
struct Row {
    line: u64,
    /// Time, seconds; 0 in a file of waypoints.
    time: f64,
    position: Point3<f64>,
}

/// Returns the path of a program in G-code.
fn of_program(program: gcode::Program) -> Result<PathFile, PathFileError> {
    let gcode::Program { places, speeds, lines } = program;
    if places.is_empty() {
        return Err(PathFileError::NoMotion);
    }
    Ok(PathFile::Waypoints { places, speeds, lines })
}

/// Parses the text of a file.
///
/// # Errors
/// Where the first line names other columns, there are no places, or lines have mistakes; all of
/// them at once.
pub fn parse(text: &str) -> Result<PathFile, PathFileError> {
    if gcode::is_gcode(text) {
        return of_program(gcode::parse(text).map_err(PathFileError::Code)?);
    }
    let mut table = Table::of(text);
    let columns = columns(&mut table)?;
    let (mut rows, mut mistakes) = (Vec::new(), Vec::new());
    for fields in table.rows() {
        rows.extend(row(fields, &table, &columns, &mut mistakes));
    }
    if columns.kind == Kind::Timed {
        mistakes.extend(rows.windows(2).filter_map(|pair| order_mistake(&pair[0], &pair[1])));
    }
    if !mistakes.is_empty() {
        return Err(PathFileError::Lines(mistakes));
    }
    if rows.is_empty() {
        return Err(PathFileError::Empty);
    }
    let lines = rows.iter().map(|row| row.line).collect();
    Ok(match columns.kind {
        Kind::Places => {
            let places = rows.iter().map(|row| row.position).collect();
            PathFile::Waypoints { places, speeds: Vec::new(), lines }
        }
        Kind::Timed => {
            let sample = |row: &Row| Sample { time: row.time, position: row.position };
            PathFile::Samples { samples: rows.iter().map(sample).collect(), lines }
        }
    })
}

/// Returns the columns that the first line names. Three columns without names are places.
fn columns(table: &mut Table) -> Result<Columns, PathFileError> {
    let names = table.take_names();
    let Some(first) = names.as_ref().or(table.rows().first()) else {
        return Err(PathFileError::Empty);
    };
    if names.is_none() && first.fields.len() == Kind::Places.names().len() {
        return Ok(Columns::unnamed());
    }
    Columns::named(&first.fields).ok_or_else(|| PathFileError::Header {
        line: first.line,
        found: first.in_short(),
        wrong: match (table.spaces_mistake(first), &names) {
            (Some(spaces), _) => format!(": {spaces}"),
            (None, Some(names)) => format!(": {}", wrong_columns(&names.fields)),
            (None, None) => format!(": {}", unnamed(first, table)),
        },
    })
}

/// Returns what to do about a first line with numbers that are not three.
fn unnamed(first: &table::Row, table: &Table) -> String {
    let counts = Kind::ALL.map(|kind| kind.names().len());
    let are_timed = first.fields.len() == Kind::Timed.names().len();
    let mistake = || counts.into_iter().find_map(|count| table.separator_mistake(first, count));
    let mistake = if are_timed { None } else { mistake() };
    mistake.unwrap_or_else(|| "put a first line with these names before the numbers".to_owned())
}

/// Returns which names of columns are wrong, where they are those of no [`Kind`].
fn wrong_columns(names: &[String]) -> String {
    let has_times = names.iter().any(|name| is_time(name));
    let known = if has_times { Kind::Timed.names() } else { Kind::Places.names() };
    wrong_names(names, known, known.len())
}

/// Returns the place of a line. Adds its mistakes to `mistakes`; `None` if it has one.
fn row(
    row: &table::Row,
    table: &Table,
    columns: &Columns,
    mistakes: &mut Vec<LineMistake>,
) -> Option<Row> {
    let (line, fields) = (row.line, &row.fields);
    let names = columns.kind.names();
    if fields.len() != names.len() || row.bracket_mistake().is_some() {
        let (count, expected) = (fields.len(), names.len());
        let mistake = match table.separator_mistake(row, expected) {
            Some(why) => LineMistake::Separators { line, why, more: 0 },
            None => LineMistake::Columns { line, count, expected, more: 0 },
        };
        mistake.add_to(mistakes);
        return None;
    }
    let mut values = [None; 4];
    for (&place, field) in columns.places.iter().zip(fields) {
        let name = names[place];
        match table.number(field) {
            Some(value) if name != "t" && value.abs() > MAX_COORDINATE_M => {
                LineMistake::Range { line, name, value, more: 0 }.add_to(mistakes);
            }
            Some(value) => values[place] = Some(value),
            None => mistakes.push(LineMistake::Field { line, name, value: field.clone() }),
        }
    }
    let (time, [x, y, z]) = match (columns.kind, values) {
        (Kind::Places, [x, y, z, _]) => (0.0, [x?, y?, z?]),
        (Kind::Timed, [time, x, y, z]) => (time?, [x?, y?, z?]),
    };
    Some(Row { line, time, position: Point3::new(x, y, z) })
}

/// Returns the mistake of a line whose time does not follow that of the one before.
fn order_mistake(before: &Row, row: &Row) -> Option<LineMistake> {
    let Row { line, time, .. } = *row;
    (time <= before.time).then_some(LineMistake::TimeNotRising { line, time })
}

#[cfg(test)]
mod tests;
