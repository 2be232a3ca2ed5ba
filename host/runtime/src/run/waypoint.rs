//! Waypoints: targets with a dwell time and a tolerance, and the file that lists them.

use std::path::{Path, PathBuf};

use plumb_cameras::bounded_read::{ReadError, read_text};
use plumb_cameras::toml_file::{Coordinate, MAX_BYTES, Range};
use plumb_protocol::config::Workspace;
use plumb_protocol::units::Point;
use thiserror::Error;

use super::error::RunError;
use crate::rig::quantity::Distance;
use crate::summary::round;

/// Target of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// Place of the ball, metres in the rig frame.
    pub target: [f64; 3],
    /// Time for which the board keeps the ball there, seconds; it may be infinite.
    pub dwell_s: f64,
    /// Distance within which the target counts as reached, metres; `None` for the rig file's.
    pub tolerance_m: Option<f64>,
}

impl Waypoint {
    /// Returns the waypoint of a target with the rig file's tolerance, and without a dwell time.
    pub fn new(target: [f64; 3]) -> Self {
        Self { target, dwell_s: 0.0, tolerance_m: None }
    }
}

/// Waypoint within the workspace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CheckedWaypoint {
    /// The target in the board's units.
    pub(super) point: Point,
    /// The waypoint, with the target rounded to the board's unit.
    pub(super) waypoint: Waypoint,
}

/// Waypoints of a run.
#[derive(Debug, Clone)]
pub(super) struct Route {
    pub(super) waypoints: Vec<CheckedWaypoint>,
    /// Whether the first waypoint follows the last one.
    pub(super) is_repeated: bool,
}

impl Route {
    /// Checks the waypoints of a run.
    ///
    /// # Errors
    /// Where there are none, or one is outside the workspace.
    pub(super) fn new(
        waypoints: &[Waypoint],
        is_repeated: bool,
        workspace: &Workspace,
    ) -> Result<Self, RunError> {
        if waypoints.is_empty() {
            return Err(RunError::NoTargets);
        }
        let (mut inside, mut outside) = (Vec::new(), Vec::new());
        for waypoint in waypoints {
            let point = Point::from_metres(waypoint.target);
            match point.filter(|point| workspace.contains(*point)) {
                Some(point) => {
                    let waypoint = Waypoint { target: point.to_metres(), ..*waypoint };
                    inside.push(CheckedWaypoint { point, waypoint });
                }
                None => outside.push(waypoint.target.map(|metres| round(metres, 1e6))),
            }
        }
        if !outside.is_empty() {
            return Err(RunError::TargetsOutside(outside));
        }
        Ok(Self { waypoints: inside, is_repeated })
    }
}

/// Mistake in a file of waypoints.
#[derive(Debug, Error)]
pub enum WaypointError {
    /// The file cannot be read.
    #[error("waypoints")]
    Read(#[from] ReadError),
    /// The file has no waypoints.
    #[error("{}: no waypoints; each line is x, y, z, dwell, tolerance", .0.display())]
    Empty(PathBuf),
    /// Lines of the file have mistakes.
    #[error("{}", listed(.path, .mistakes))]
    Mistakes {
        /// The file.
        path: PathBuf,
        /// The mistakes, in the order of the lines; at least one.
        mistakes: Vec<WaypointMistake>,
    },
}

/// Mistake in a line of a file of waypoints.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum WaypointMistake {
    /// The line has too few or too many columns.
    #[error("{line}: {count} columns; a line has 3 to 5: x, y, z, dwell, tolerance")]
    Columns {
        /// Line, from 1.
        line: usize,
        /// Number of columns.
        count: usize,
    },
    /// A field is no number, or out of range.
    #[error("{line}: column {column} ({name}): '{value}': {why}")]
    Field {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Name of the column.
        name: &'static str,
        /// The field.
        value: String,
        /// Reason.
        why: String,
    },
}

/// Number of mistakes of a file that a message lists.
const MAX_LISTED: usize = 20;

/// Returns a line for each mistake, without those above [`MAX_LISTED`].
fn listed(path: &Path, mistakes: &[WaypointMistake]) -> String {
    let shown = mistakes.iter().take(MAX_LISTED);
    let mut lines: Vec<String> =
        shown.map(|mistake| format!("{}:{mistake}", path.display())).collect();
    if let Some(more) = mistakes.len().checked_sub(MAX_LISTED).filter(|more| *more > 0) {
        lines.push(format!("{}: {more} more mistakes", path.display()));
    }
    lines.join("\n")
}

/// Names of the columns.
const COLUMNS: [&str; 5] = ["x", "y", "z", "dwell", "tolerance"];

/// Range of a dwell time: up to a day.
const DWELL: Range = Range::new(0.0, 86_400.0, "s");

/// Range of a tolerance.
const TOLERANCE: Range = Distance::RANGE;

/// Reads a file of waypoints. A line is `x, y, z, dwell, tolerance`: metres in the rig frame,
/// seconds, metres. The last two may be left out or empty. Empty lines, lines that begin with `#`,
/// and a first line with the names of the columns are left out.
///
/// # Errors
/// Where the file cannot be read, has no waypoints, or a field is wrong; all wrong fields at once.
pub fn read_waypoints(path: &Path) -> Result<Vec<Waypoint>, WaypointError> {
    parse_waypoints(path, &read_text(path, MAX_BYTES)?)
}

/// Parses the text of the file `path`.
fn parse_waypoints(path: &Path, text: &str) -> Result<Vec<Waypoint>, WaypointError> {
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#')).peekable();
    lines.next_if(|(_, line)| line.split(',').next().is_some_and(|name| name.trim() == COLUMNS[0]));
    let (mut waypoints, mut mistakes) = (Vec::new(), Vec::new());
    for (number, line) in lines {
        waypoints.extend(parse_line(number, line, &mut mistakes));
    }
    let path = path.to_owned();
    if !mistakes.is_empty() {
        Err(WaypointError::Mistakes { path, mistakes })
    } else if waypoints.is_empty() {
        Err(WaypointError::Empty(path))
    } else {
        Ok(waypoints)
    }
}

/// Parses a line of the file. Adds its mistakes to `mistakes`; `None` if it has one.
fn parse_line(line: usize, text: &str, mistakes: &mut Vec<WaypointMistake>) -> Option<Waypoint> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let count = fields.len();
    if !(3..=COLUMNS.len()).contains(&count) {
        mistakes.push(WaypointMistake::Columns { line, count });
        return None;
    }
    let before = mistakes.len();
    let mut values = [None; COLUMNS.len()];
    for (index, field) in fields.iter().enumerate() {
        // The last two may be empty.
        if index >= 3 && field.is_empty() {
            continue;
        }
        match parse_field(index, field) {
            Ok(value) => values[index] = Some(value),
            Err(why) => mistakes.push(WaypointMistake::Field {
                line,
                column: index + 1,
                name: COLUMNS[index],
                value: (*field).to_owned(),
                why,
            }),
        }
    }
    let [Some(x), Some(y), Some(z), dwell_s, tolerance_m] = values else { return None };
    let waypoint = Waypoint { target: [x, y, z], dwell_s: dwell_s.unwrap_or(0.0), tolerance_m };
    (mistakes.len() == before).then_some(waypoint)
}

/// Parses the field of the column `index`. Returns the reason in words where it is wrong.
fn parse_field(index: usize, field: &str) -> Result<f64, String> {
    let value: f64 = field.parse().map_err(|_| "must be a number".to_owned())?;
    let range = match COLUMNS[index] {
        "tolerance" => TOLERANCE,
        "dwell" => DWELL,
        _ => Coordinate::RANGE,
    };
    range.check(value).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Vec<Waypoint>, String> {
        parse_waypoints(Path::new("way.csv"), text).map_err(|error| error.to_string())
    }

    #[test]
    fn dwell_and_tolerance_may_be_left_out() {
        let text = "x, y, z, dwell, tolerance\n# a comment\n\n0.4,0.3,0.2\n0.5, -0.1, 0.3, 2\n\
                    0.4,0.3,0.2,,0.02\n";
        let at = |target, dwell_s, tolerance_m| Waypoint { target, dwell_s, tolerance_m };
        let expected = vec![
            at([0.4, 0.3, 0.2], 0.0, None),
            at([0.5, -0.1, 0.3], 2.0, None),
            at([0.4, 0.3, 0.2], 0.0, Some(0.02)),
        ];
        assert_eq!(parse(text), Ok(expected));
    }

    #[test]
    fn a_mistake_is_named_with_its_line_and_column() {
        for (text, named) in [
            ("0.4,0.3,0.2\n0.4,0,3,0.2,1,1\n", "way.csv:2: 6 columns"),
            ("x,y,z\n0.4,0.3\n", "way.csv:2: 2 columns"),
            ("0.4,o.3,0.2\n", "way.csv:1: column 2 (y): 'o.3': must be a number"),
            ("0.4,0.3,inf\n", "way.csv:1: column 3 (z): 'inf'"),
            ("0.4,0.3,0.2,-1\n", "way.csv:1: column 4 (dwell): '-1': -1.0 must be 0 to 86400 s"),
            ("0.4,0.3,0.2,1,0\n", "way.csv:1: column 5 (tolerance): '0'"),
            ("x,y,z\n", "way.csv: no waypoints"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(named), "{error}");
        }
    }

    #[test]
    fn all_mistakes_of_a_file_are_named_at_once() {
        let error = parse("0.4,o.3,nan,-1\n0.4,0.3,0.2\n0.4\n0.4,0.3,0.2,,-2\n").unwrap_err();
        let lines: Vec<&str> = error.lines().collect();
        let places = ["1: column 2", "1: column 3", "1: column 4", "3: 1 columns", "4: column 5"];
        assert_eq!(lines.len(), places.len(), "{error}");
        for (line, place) in lines.iter().zip(places) {
            assert!(line.starts_with(&format!("way.csv:{place}")), "{error}");
        }
        let error = parse(&"nonsense\n".repeat(1000)).unwrap_err();
        assert_eq!(error.lines().count(), MAX_LISTED + 1, "{error}");
        assert!(error.ends_with("980 more mistakes"), "{error}");
    }

    #[test]
    fn a_target_outside_the_workspace_is_named_in_micrometres() {
        let point = |metres| Point::from_metres(metres).unwrap();
        let workspace = Workspace { min: point([0.5; 3]), max: point([1.0; 3]) };
        let target = point([0.4, -0.1, 0.3]).to_metres();
        let error = Route::new(&[Waypoint::new(target)], false, &workspace).err().unwrap();
        assert!(error.to_string().contains("the target [0.4, -0.1, 0.3] m is"), "{error}");
        let targets = [[0.6; 3], target, [1.5; 3]].map(Waypoint::new);
        let error = Route::new(&targets, false, &workspace).err().unwrap().to_string();
        assert!(error.contains("the targets [0.4, -0.1, 0.3], [1.5, 1.5, 1.5] m are"), "{error}");
    }
}
