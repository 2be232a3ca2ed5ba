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
use crate::table::{self, Table, and_more, column_count, is_time, places_of, wrong_names};
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
    #[error("{line}: column {name}: '{value}' is no finite number")]
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
        lines.push(format!("{more} more mistakes"));
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
    let is_complete = first.fields.last().is_some_and(|field| !field.is_empty());
    let are_timed = is_complete && first.fields.len() == Kind::Timed.names().len();
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
        match table.number(field).filter(|value| value.is_finite()) {
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
mod tests {
    use super::*;

    #[test]
    fn waypoints_and_samples_are_read() {
        let places = "# a path\nx, y, z\n0.4,0.3,0.2\n\n0.5, -0.1, 0.3\n";
        let expected = vec![Point3::new(0.4, 0.3, 0.2), Point3::new(0.5, -0.1, 0.3)];
        let (speeds, lines) = (Vec::new(), vec![3, 5]);
        assert_eq!(
            parse(places),
            Ok(PathFile::Waypoints { places: expected.clone(), speeds, lines })
        );
        assert_eq!(parse(places).unwrap().places(), [(3, expected[0]), (5, expected[1])]);
        let timed = "t,x,y,z\n0,0.4,0.3,0.2\n1.5,0.5,-0.1,0.3\n";
        let sample = |time, [x, y, z]: [f64; 3]| Sample { time, position: Point3::new(x, y, z) };
        let expected = vec![sample(0.0, [0.4, 0.3, 0.2]), sample(1.5, [0.5, -0.1, 0.3])];
        assert_eq!(parse(timed), Ok(PathFile::Samples { samples: expected, lines: vec![2, 3] }));
    }

    #[test]
    fn columns_come_in_any_order() {
        let places = vec![Point3::new(0.4, 0.3, 0.2)];
        let (speeds, lines) = (Vec::new(), vec![2]);
        let expected = PathFile::Waypoints { places: places.clone(), speeds, lines };
        assert_eq!(parse("z;y;x\n0,2;0,3;0,4\n"), Ok(expected));
        let samples = vec![Sample { time: 1.5, position: places[0] }];
        let expected = PathFile::Samples { samples, lines: vec![2] };
        assert_eq!(parse("z [m],y,t,x\n0.2,0.3,1.5,0.4\n"), Ok(expected));
    }

    #[test]
    fn spreadsheets_of_other_languages_and_pauses_are_read() {
        let at = [[0.42, 0.24, 0.3], [0.54, 0.24, 0.3], [0.54, 0.24, 0.3]].map(Point3::from);
        let (places, speeds, lines) = (at.to_vec(), Vec::new(), vec![2, 3, 4]);
        let expected = Ok(PathFile::Waypoints { places, speeds, lines });
        let lines = "0.42,0.24,0.3\n0.54,0.24,0.3\n0.54,0.24,0.3\n";
        assert_eq!(parse(&format!("\u{feff}X,Y,Z\n{lines}")), expected);
        let commas = format!("x,y,z\n{lines}").replace(',', ";").replace('.', ",");
        assert_eq!(parse(&commas), expected);
        assert_eq!(parse(lines).unwrap().places(), [(1, at[0]), (2, at[1]), (3, at[2])]);
    }

    #[test]
    fn a_mistake_is_named_with_its_line() {
        for (text, named) in [
            ("", "no places"),
            ("x,y,z\n", "no places"),
            ("0.4,o.3,0.2\n", "1: column y: 'o.3' is no finite number"),
            ("0.4,0.3\n", "1: the columns are '0.4,0.3', but must be 'x,y,z'"),
            ("0,4,0,3,0,2\n", "1: the columns are '0,4,0,3,0,2', but must be 'x,y,z'"),
            ("0,4,0,3,0,2\n", "seconds): commas are the decimal sign and separate the columns"),
            ("0,0,4,0,3,0,2\n", "seconds): commas are the decimal sign and separate the columns"),
            ("0,1,1,1\n", "seconds): put a first line with these names before the numbers"),
            ("0.4,0.3,0.2,\n", "seconds): the line ends with a separator: remove it there"),
            ("0.4 0.3 0.2\n", "seconds): spaces do not separate columns: write 0.4,0.3,0.2"),
            ("0,4 0,3 0,2\n", "seconds): spaces do not separate columns: write 0,4;0,3;0,2"),
            ("X Y z_m\n1 1 1\n", "seconds): spaces do not separate columns: write X,Y,z_m"),
            ("my path\n1,1,1\n", "seconds): 'my path' is unknown, x is missing"),
            ("x,y,z,\n1,1,1,\n", "seconds): the line ends with a separator: remove it there"),
            ("x,y,z\n1,1,1,\n1,1,1,\n", "2: the line ends with a separator: remove it there (1"),
            ("x,y,z\n1;1;1\n", "2: the line separates its columns by semicolons, but the first"),
            ("x,y,z\n0,4;1;1\n", "line by commas: separate all by semicolons"),
            ("x;y;z\n0.4,1,1\n", "line by semicolons: separate all by commas"),
            ("x,y,z\n0.4 1 1\n", "2: spaces do not separate columns: write 0.4,1,1"),
            (",x,y,z\n0,1,1,1\n", "1: the columns are ',x,y,z', but must be 'x,y,z'"),
            (",x,y,z\n0,1,1,1\n", "seconds): column 1 has no name (pandas writes its index"),
            ("# t,x,y,z\n0,1,1,1\n0,1,1,1\n", "3: the time 0 s is not above"),
            ("# x_mm,y,z\n1,1,1\n", "1: the columns are 'x_mm,y,z', but must be 'x,y,z'"),
            ("a,b,c,d,e,f,g\n", "1: the columns are 'a,b,c,d, and 3 more', but must be 'x,y,z'"),
            ("time,x,y,z\n0,1,1,1\n", "seconds): 'time' is unknown: write t"),
            ("t_ms,x,y,z\n0,1,1,1\n", "): 't_ms' must be in seconds: convert it, and write t"),
            ("timestamp,x,y,z\n0,1,1,1\n", "seconds): 'timestamp' is unknown: write t"),
            ("[0.6, 0.25, 0.3]\n", "1: brackets do not belong to a table: write 0.6, 0.25, 0.3"),
            ("[[1,1,1],\n[1,1,1]]\n", "): brackets do not belong to a table: write 1,1,1"),
            ("x,y,z\n[0.6 1 1]\n", "2: brackets do not belong to a table: write 0.6,1,1"),
            ("x_mm,y,z\n1,1,1\n", "seconds): 'x_mm' must be in metres: convert it, and write x"),
            ("x,y,z\n# a\n0.4,0.3\n", "3: 2 columns, but the first line names 3"),
            ("x,y,z\n0.4,0.3\n1,1\n", "2: 2 columns, but the first line names 3 (1 more line too)"),
            ("x,y,z\n0.4,o.3,0.2\n", "2: column y: 'o.3' is no finite number"),
            ("x,y,z\n0.4,0.3,inf\n", "2: column z: 'inf' is no finite number"),
            ("x,y,z\n0.4,300,0.2\n", "2: column y: 300 m is out of range, ±100"),
            ("x,y,z\n420,240,300\n", "are these millimetres?"),
            ("z,y,x\n0.4,o.3,0.2\n", "2: column y: 'o.3' is no finite number"),
            ("x,y,w\n0.4,0.3,0.2\n", "seconds): 'w' is unknown, z is missing"),
            ("t,x,y\n0,0.4,0.3\n", "seconds): z is missing"),
            ("x,y,z,y\n1,1,1,1\n", "seconds): y is there 2 times"),
            ("0,0.4,0.3,0.2\n", "1: the columns are '0,0.4,0.3,0.2', but must be 'x,y,z'"),
            ("t,x,y,z\n1,1,1,1\n1,2,1,1\n", "3: the time 1 s is not above"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(named), "{error}");
        }
    }

    #[test]
    fn a_mistake_of_the_whole_file_is_named_once() {
        let lines =
            |line: &str| parse(&format!("x,y,z\n{}", line.repeat(3))).unwrap_err().to_string();
        let commas = "2: commas are the decimal sign and separate the columns too: write points \
                      (0.4,0.5,0.2), or separate the columns by semicolons (0,4;0,5;0,2)";
        assert_eq!(lines("0,4,0,5,0,2\n"), format!("{commas} (2 more lines too)"));
        assert_eq!(
            lines("420,240,30\n"),
            "2: column x: 420 m is out of range, ±100 (metres); are these millimetres? \
             (5 more numbers too)"
        );
        let timed = "t,x,y,z\n0,0,4,0,5,0,2\n";
        assert_eq!(parse(timed).unwrap_err().to_string(), commas);
    }

    #[test]
    fn all_mistakes_are_named_at_once() {
        let error = parse("x,y,z\n0.4,o.3,nan\n0.4,0.3,0.2\n0.4\n").unwrap_err().to_string();
        assert_eq!(error.lines().count(), 3, "{error}");
        let many = format!("x,y,z\n{}", "0.4,o.3,0.2\n".repeat(1000));
        let error = parse(&many).unwrap_err().to_string();
        assert_eq!(error.lines().count(), MAX_LISTED + 1, "{error}");
        assert!(error.ends_with("980 more mistakes"), "{error}");
    }
}
