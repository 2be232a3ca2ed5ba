//! Waypoints: targets with a dwell time and a tolerance, and the file that lists them.

use std::path::{Path, PathBuf};

use plumb_cameras::bounded_read::{ReadError, read_text};
use plumb_cameras::toml_file::{Finite, MAX_BYTES, NumberError, Positive};
use plumb_protocol::config::Workspace;
use plumb_protocol::units::Point;
use thiserror::Error;

use super::error::RunError;
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
        let check = |waypoint: &Waypoint| {
            let point = Point::from_metres(waypoint.target);
            let point = point.filter(|point| workspace.contains(*point));
            let shown = waypoint.target.map(|metres| round(metres, 1e6));
            let point = point.ok_or(RunError::TargetOutside(shown))?;
            let waypoint = Waypoint { target: point.to_metres(), ..*waypoint };
            Ok(CheckedWaypoint { point, waypoint })
        };
        let waypoints = waypoints.iter().map(check).collect::<Result<_, _>>()?;
        Ok(Self { waypoints, is_repeated })
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
    /// A line has too few or too many columns.
    #[error(
        "{}:{line}: {count} columns; a line has 3 to 5: x, y, z, dwell, tolerance",
        .path.display()
    )]
    Columns {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Number of columns.
        count: usize,
    },
    /// A field is no number, or out of range.
    #[error("{}:{line}: column {} ({name}): '{value}': {why}", .path.display(), .column)]
    Field {
        /// The file.
        path: PathBuf,
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

/// Names of the columns.
const COLUMNS: [&str; 5] = ["x", "y", "z", "dwell", "tolerance"];

/// Longest dwell time, seconds: a day.
const MAX_DWELL_S: f64 = 86_400.0;

/// Reads a file of waypoints. A line is `x, y, z, dwell, tolerance`: metres in the rig frame,
/// seconds, metres. The last two may be left out or empty. Empty lines, lines that begin with `#`,
/// and a first line with the names of the columns are left out.
///
/// # Errors
/// Where the file cannot be read, has no waypoints, or a field is wrong.
pub fn read_waypoints(path: &Path) -> Result<Vec<Waypoint>, WaypointError> {
    parse_waypoints(path, &read_text(path, MAX_BYTES)?)
}

/// Parses the text of the file `path`.
fn parse_waypoints(path: &Path, text: &str) -> Result<Vec<Waypoint>, WaypointError> {
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#')).peekable();
    lines.next_if(|(_, line)| line.split(',').next().is_some_and(|name| name.trim() == COLUMNS[0]));
    let waypoints: Vec<Waypoint> =
        lines.map(|(number, line)| parse_line(path, number, line)).collect::<Result<_, _>>()?;
    if waypoints.is_empty() { Err(WaypointError::Empty(path.to_owned())) } else { Ok(waypoints) }
}

fn parse_line(path: &Path, line: usize, text: &str) -> Result<Waypoint, WaypointError> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let count = fields.len();
    if !(3..=COLUMNS.len()).contains(&count) {
        return Err(WaypointError::Columns { path: path.to_owned(), line, count });
    }
    let wrong = |index: usize, why: String| WaypointError::Field {
        path: path.to_owned(),
        line,
        column: index + 1,
        name: COLUMNS[index],
        value: fields[index].to_owned(),
        why,
    };
    let number = |index: usize| -> Result<f64, WaypointError> {
        let value =
            fields[index].parse::<f64>().map_err(|_| wrong(index, "must be a number".into()))?;
        let check = |value: f64| -> Result<f64, NumberError> {
            if COLUMNS[index] == "tolerance" {
                Ok(Positive::try_from(value)?.get())
            } else {
                Ok(Finite::try_from(value)?.get())
            }
        };
        check(value).map_err(|error| wrong(index, error.to_string()))
    };
    let optional = |index: usize| match fields.get(index) {
        Some(field) if !field.is_empty() => number(index).map(Some),
        _ => Ok(None),
    };
    let dwell_s = optional(3)?.unwrap_or(0.0);
    if !(0.0..=MAX_DWELL_S).contains(&dwell_s) {
        return Err(wrong(3, format!("must be from 0 to {MAX_DWELL_S} s")));
    }
    let target = [number(0)?, number(1)?, number(2)?];
    Ok(Waypoint { target, dwell_s, tolerance_m: optional(4)? })
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
            ("0.4,0.3,0.2,-1\n", "way.csv:1: column 4 (dwell): '-1': must be from 0"),
            ("0.4,0.3,0.2,1,0\n", "way.csv:1: column 5 (tolerance): '0'"),
            ("x,y,z\n", "way.csv: no waypoints"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(named), "{error}");
        }
    }

    #[test]
    fn a_target_outside_the_workspace_is_named_in_micrometres() {
        let point = |metres| Point::from_metres(metres).unwrap();
        let workspace = Workspace { min: point([0.5; 3]), max: point([1.0; 3]) };
        let target = point([0.4, -0.1, 0.3]).to_metres();
        let error = Route::new(&[Waypoint::new(target)], false, &workspace).err().unwrap();
        assert!(error.to_string().contains("[0.4, -0.1, 0.3] m"), "{error}");
    }
}
