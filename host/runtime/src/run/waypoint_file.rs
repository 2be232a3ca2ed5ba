//! The file that lists the waypoints of a run.

mod mistake;

use std::path::Path;

use plumb_cameras::camera_file::is_rig_file;
use plumb_config::bounded_read::read_text;
use plumb_config::quantity::{Coordinate, Range};
use plumb_config::toml_file::MAX_BYTES;
use plumb_path::file::is_gcode;
use plumb_path::table::{Row, Table, is_time, places_of, wrong_names};

use super::Waypoint;
use crate::rig::MotionRules;
use crate::rig::quantity::Distance;
use crate::run_log::is_run_log;

pub use mistake::{WaypointError, WaypointMistake};

/// Names of the columns.
const COLUMNS: [&str; 5] = ["x", "y", "z", "dwell", "tolerance"];

/// Number of the first columns, without which a line is no place.
const COORDINATES: usize = 3;

/// Range of a dwell time: up to a day.
const DWELL: Range = Range::new(0.0, 86_400.0, "s");

/// Range of a tolerance.
const TOLERANCE: Range = Distance::RANGE;

/// Reads a file of waypoints: x, y, z in metres in the rig frame, the dwell time in seconds, the
/// tolerance in metres. The first line names the columns, in any order; where it does not, there
/// are x, y, z. Dwell time and tolerance may be left out or empty.
///
/// # Errors
/// Where the file cannot be read, names other columns, has no waypoints, or a field is wrong or a
/// place not allowed by `rules`; all wrong fields and places at once.
pub fn read_waypoints(path: &Path, rules: &MotionRules) -> Result<Vec<Waypoint>, WaypointError> {
    parse_waypoints(path, &read_text(path, MAX_BYTES)?, rules)
}

/// Parses the text of the file `path`.
fn parse_waypoints(
    path: &Path,
    text: &str,
    rules: &MotionRules,
) -> Result<Vec<Waypoint>, WaypointError> {
    if let Some(is) = other_kind(text) {
        return Err(WaypointError::OtherKind { path: path.to_owned(), is });
    }
    let mut table = Table::of(text);
    let columns = table.take_names().map(Columns::named).transpose();
    let path = path.to_owned();
    let columns = match columns {
        Ok(columns) => columns,
        Err(names) => {
            let wrong = table.spaces_mistake(&names).unwrap_or_else(|| wrong_columns(&names));
            let (line, found) = (names.line, names.in_short());
            return Err(WaypointError::Names { path, line, found, wrong });
        }
    };
    let (mut waypoints, mut mistakes) = (Vec::new(), Vec::new());
    for row in table.rows() {
        let Some(waypoint) = parse_row(row, &table, columns.as_ref(), &mut mistakes) else {
            continue;
        };
        let (line, target) = (row.line, waypoint.target);
        match rules.target(target) {
            Ok(_) => waypoints.push(waypoint),
            Err(error) => {
                WaypointMistake::Place { line, target, error, more: 0 }.add_to(&mut mistakes);
            }
        }
    }
    if !mistakes.is_empty() {
        Err(WaypointError::Mistakes { path, mistakes })
    } else if waypoints.is_empty() {
        Err(WaypointError::Empty(path))
    } else {
        Ok(waypoints)
    }
}

/// What G-code is, and where it belongs.
pub(crate) const GCODE: &str = "this is G-code, a path: give it with --path";

/// What a file with times is, and where it belongs.
const TIMED: &str = "a file with times is a path: --path";

/// Returns what a file is that lists no waypoints; `None` for any other file.
fn other_kind(text: &str) -> Option<&'static str> {
    if is_gcode(text) {
        Some(GCODE)
    } else if text.trim_start().starts_with('{') {
        Some("these are moving targets in JSON: give them with --targets")
    } else if is_run_log(text) {
        Some("this is the log of a run: write a file with only its columns x_m,y_m,z_m")
    } else if is_rig_file(text) {
        Some("this is a rig file, and no list of waypoints: `plumb run` drives to its targets")
    } else {
        None
    }
}

/// Returns the end of a message about the names of columns: those that are wrong.
fn wrong_columns(names: &Row) -> String {
    let wrong = wrong_names(&names.fields, &COLUMNS, COORDINATES);
    match names.fields.iter().any(|name| is_time(name)) {
        true => format!("{wrong}; {TIMED}"),
        false => wrong,
    }
}

/// Columns of a file, each by its place in [`COLUMNS`].
struct Columns(Vec<usize>);

impl Columns {
    /// Returns the columns of a line of names, or the line where they are others: each once, and
    /// all coordinates.
    fn named(names: Row) -> Result<Self, Row> {
        match places_of(&names.fields, &COLUMNS, COORDINATES) {
            Some(places) => Ok(Self(places)),
            None => Err(names),
        }
    }

    /// Returns the least number of fields of a line: the last coordinate is among them.
    fn least(&self) -> usize {
        let last = self.0.iter().rposition(|place| *place < COORDINATES);
        last.map_or(COORDINATES, |index| index + 1)
    }
}

/// Parses a line. Adds its mistakes to `mistakes`; `None` if it has one.
fn parse_row(
    row: &Row,
    table: &Table,
    columns: Option<&Columns>,
    mistakes: &mut Vec<WaypointMistake>,
) -> Option<Waypoint> {
    let (line, count) = (row.line, row.fields.len());
    let unnamed = Columns((0..COORDINATES).collect());
    let named = columns.unwrap_or(&unnamed);
    let Columns(places) = named;
    let most = places.len();
    if !(named.least()..=most).contains(&count) || row.bracket_mistake().is_some() {
        let mistake = match (table.separator_mistake(row, most), columns) {
            (Some(why), _) => {
                let is_timed = table.has_spaced_time();
                let why = if is_timed { format!("{why}; {TIMED}") } else { why };
                WaypointMistake::Separators { line, why, more: 0 }
            }
            (None, Some(_)) => WaypointMistake::Columns { line, count, most, more: 0 },
            (None, None) => WaypointMistake::Unnamed { line, count, more: 0 },
        };
        mistake.add_to(mistakes);
        return None;
    }
    let before = mistakes.len();
    let mut values = [None; COLUMNS.len()];
    for (index, (field, &place)) in row.fields.iter().zip(places).enumerate() {
        // Dwell time and tolerance may be empty.
        if place >= COORDINATES && field.is_empty() {
            continue;
        }
        match checked(place, table.number(field)) {
            Ok(value) => values[place] = Some(value),
            Err(why) => mistakes.push(WaypointMistake::Field {
                line,
                column: index + 1,
                name: COLUMNS[place],
                value: field.clone(),
                why,
            }),
        }
    }
    let [Some(x), Some(y), Some(z), dwell_s, tolerance_m] = values else { return None };
    let waypoint = Waypoint { target: [x, y, z], dwell_s: dwell_s.unwrap_or(0.0), tolerance_m };
    (mistakes.len() == before).then_some(waypoint)
}

/// Checks the number of a column, by its place in [`COLUMNS`]. Returns the reason in words where it
/// is wrong.
fn checked(place: usize, number: Option<f64>) -> Result<f64, String> {
    let value = number.ok_or_else(|| "must be a number".to_owned())?;
    let range = match COLUMNS[place] {
        "tolerance" => TOLERANCE,
        "dwell" => DWELL,
        // Whether the rig allows the place is checked later, with its unit.
        _ if value.is_finite() => return Ok(value),
        _ => Coordinate::RANGE,
    };
    range.check(value).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::mistake::MAX_LISTED;
    use super::*;
    use crate::rig::quantity::Corner;
    use crate::rig::{Box3, Rig};

    fn parse(text: &str) -> Result<Vec<Waypoint>, String> {
        let [min, max] = [-4.0, 4.0].map(|border| [Corner::constant(border); 3]);
        let workspace = Box3 { min, max };
        let wide = Rig { workspace, simulation: None, ..Rig::paper().unwrap() };
        parse_waypoints(Path::new("way.csv"), text, &wide.motion_rules())
            .map_err(|error| error.to_string())
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
    fn columns_come_in_any_order_and_numbers_with_a_decimal_comma() {
        let target = [0.4, -0.1, 0.2];
        let expected = vec![Waypoint { target, dwell_s: 2.0, tolerance_m: None }];
        assert_eq!(parse("\u{feff}Dwell [s];Z [m];Y;X (m)\n2;0,2;-0,1;0,4\n"), Ok(expected));
        for text in [
            "0,4;-0,1;0,2\n",
            "x in m;y/m;z [Meter];;\n0,4;-0,1;0,2;;\n",
            "x,y,z,dwell\n0.4,-0.1,0.2,,,\n",
            "# x,y,z,dwell,tolerance\n0.4,-0.1,0.2,,\n",
            "0.4,-0.1,0.2,,\n",
            "x,y,z\r0.4,-0.1,0.2\r",
        ] {
            assert_eq!(parse(text), Ok(vec![Waypoint::new(target)]), "{text}");
        }
        let dwell = "x;y;z;dwell in s\n0,4;-0,1;0,2;2\n";
        assert_eq!(parse(dwell).map(|waypoints| waypoints[0].dwell_s), Ok(2.0));
    }

    #[test]
    fn a_mistake_is_named_with_its_line_and_column() {
        for (text, named) in [
            ("0.4,0.3,0.2\n0.4,0,3,0.2,1,1\n", "way.csv:2: 6 columns without names"),
            ("0.2\n", "way.csv:1: one column: separate x, y and z by commas"),
            ("0.2 0.3 0.24\n", "way.csv:1: spaces do not separate columns: write 0.2,0.3,0.24"),
            ("x y z\n1 1 1\n", "tolerance in metres: spaces do not separate columns: write x,y,z"),
            ("# x y z\n1 1 1\n", "in numpy: savetxt(…, delimiter=\",\", header=\"x,y,z\")"),
            ("# t x y z\n0 1 1 1\n", "\"t,x,y,z\"); a file with times is a path: --path"),
            ("1,1,\n", "way.csv:1: column 3 (z): '': must be a number"),
            ("x,y,z,\n1,1,1,a\n", "way.csv:2: 4 columns, but the first line names 3"),
            ("x,y,z\r1,1\r", "way.csv:2: 2 columns, but the first line names 3"),
            ("x;y;z;comment\n", "in metres: 'comment' is unknown: remove the column"),
            ("Nr;x;y;z\n", "in metres: 'Nr' is unknown: remove the column"),
            ("X-Position;y;z\n0,7;1;1\n", "in metres: 'X-Position' is unknown: write x"),
            ("X in mm;y;z\n", "metres: 'X in mm' must be in metres: convert it, and write x"),
            ("x,y,z\n1;1;1\n", "way.csv:2: the line separates its columns by semicolons, but"),
            ("0.2,0.3,0.24,0.3\n", "way.csv:1: 4 columns without names; 3 are x, y, z"),
            ("x,y,z\n0.4,0.3\n", "way.csv:2: 2 columns"),
            ("x,y,z\n1,1\n1,1\n1,1\n", "columns, but the first line names 3 (2 more lines too)"),
            ("x,y,z\n1,1\n0.1,1,1,1\n", "way.csv:3: 4 columns, but the first line names 3"),
            ("x,y,z\n0.4,0.3,0.2,1\n", "way.csv:2: 4 columns, but the first line names 3"),
            ("dwell,z,y,x\n1,0.4,0.3\n", "way.csv:2: 3 columns, but the first line names 4"),
            ("t,x,y,z\n0,0.4,0.3,0.2\n", "way.csv:1: the columns are 't,x,y,z'"),
            ("t,x,y,z\n0,0.4,0.3,0.2\n", "'t' is unknown; a file with times is a path: --path"),
            (
                "t_ms,x,y,z\n0,0.4,0.3,0.2\n",
                "'t_ms' is unknown; a file with times is a path: --path",
            ),
            ("x,y,z\n[1, 1, 1]\n", "way.csv:2: brackets do not belong to a table: write 1, 1, 1"),
            ("[1,1,1],\n[1,1,1]\n", "write 1,1,1 (1 more line too)"),
            (",x,y,z\n0,1,1,1\n", "way.csv:1: the columns are ',x,y,z', but must be x, y, z"),
            (",x,y,z\n0,1,1,1\n", "tolerance in metres: column 1 has no name (pandas writes"),
            ("# x,y,z,dwell\n1,1,1,-1\n", "way.csv:2: column 4 (dwell): '-1': -1 must be 0 to"),
            ("x;y;w\n0,4;0,3;0,2\n", "way.csv:1: the columns are 'x;y;w', but"),
            ("x;y;w\n0,4;0,3;0,2\n", "tolerance in metres: 'w' is unknown, z is missing"),
            ("G0 X1 Y2\n", "way.csv: this is G-code, a path: give it with --path"),
            ("{\"t\": 0, \"target\": [0.4, 0.3, 0.2]}\n", "in JSON: give them with --targets"),
            ("frame,t_s,u_px,v_px\n0,0,,\n", "way.csv: this is the log of a run: write a file"),
            ("a,b,c,d,e,f,g\n", "way.csv:1: the columns are 'a,b,c,d, and 3 more', but must"),
            ("a,b,c,d,e,f,g\n", "'c' is unknown, 'd' is unknown, and 6 more"),
            ("[board]\nport = \"x\"\n", "way.csv: this is a rig file, and no list of waypoints"),
            ("x,y,y\n0.4,0.3,0.2\n", "way.csv:1: the columns are 'x,y,y'"),
            ("x,y,dwell\n0.4,0.3,0.2\n", "way.csv:1: the columns are 'x,y,dwell'"),
            ("420,240,300\n", "is it in millimetres?"),
            ("0.4,o.3,0.2\n", "way.csv:1: column 2 (y): 'o.3': must be a number"),
            ("0.4,0.3,inf\n", "way.csv:1: column 3 (z): 'inf'"),
            ("x,y,z,dwell\n1,1,1,-1\n", "way.csv:2: column 4 (dwell): '-1': -1 must be 0 to"),
            ("x,y,z,tolerance\n1,1,1,0\n", "way.csv:2: column 4 (tolerance): '0'"),
            ("x,y,z\n", "way.csv: no waypoints"),
            ("1,1,1\n1,1,-5\n", "way.csv:2: [1.0, 1.0, -5.0] m: that is outside the workspace"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(named), "{error}");
        }
    }

    #[test]
    fn the_name_of_the_file_is_the_begin_of_each_message() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("way.csv");
        let rules = Rig::paper().unwrap().motion_rules();
        let name = path.display().to_string();
        for (bytes, says) in [
            (&b"PK\x03\x04\xff"[..], ": is a spreadsheet"),
            (b"x\0,\0y\0,\0z\0\n\0", ": is text in UTF-16"),
            (b"1,\xff,1\n", ":1: is not UTF-8"),
            (b"1,o,1\n", ":1: column 2 (y)"),
        ] {
            std::fs::write(&path, bytes).unwrap();
            let error = read_waypoints(&path, &rules).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{name}{says}")), "{error}");
        }
    }

    #[test]
    fn a_mistake_of_the_whole_file_is_named_once() {
        let thrice = |line: &str| parse(&format!("x,y,z\n{}", line.repeat(3))).unwrap_err();
        let commas = "way.csv:2: commas are the decimal sign and separate the columns too: write \
                      points (0.4,0.5,0.2), or separate the columns by semicolons (0,4;0,5;0,2)";
        assert_eq!(thrice("0,4,0,5,0,2\n"), format!("{commas} (2 more lines too)"));
        assert_eq!(parse("0,4,0,5,0,2\n").unwrap_err(), commas.replace(":2:", ":1:"));
        let error = thrice("420,2400,300\n");
        let end = "x = 420 m is above the 4 m of `workspace.max`; is it in millimetres? (2 more \
                   lines too)";
        assert!(error.starts_with("way.csv:2: [420.0, ") && error.ends_with(end), "{error}");
        let error = thrice("120,24,300\n");
        assert!(error.contains("is it in millimetres or centimetres? (2 more"), "{error}");
        // Places that are outside in each unit are listed.
        assert_eq!(thrice("1,1,-5\n").lines().count(), 3);
    }

    #[test]
    fn all_mistakes_of_a_file_are_named_at_once() {
        let error =
            parse("x,y,z,dwell,tolerance\n0.4,o.3,nan,-1\n0.4,0.3,0.2\n0.4\n0.4,0.3,0.2,,-2\n")
                .unwrap_err();
        let lines: Vec<&str> = error.lines().collect();
        let places = [
            "2: column 2",
            "2: column 3",
            "2: column 4",
            "4: 1 column, perhaps with another sep",
            "5: column 5",
        ];
        assert_eq!(lines.len(), places.len(), "{error}");
        for (line, place) in lines.iter().zip(places) {
            assert!(line.starts_with(&format!("way.csv:{place}")), "{error}");
        }
        let error = parse(&"0.4,o.3,0.2\n".repeat(1000)).unwrap_err();
        assert_eq!(error.lines().count(), MAX_LISTED + 1, "{error}");
        assert!(error.ends_with("980 more mistakes"), "{error}");
        let error = parse(&"0.4,o.3,0.2\n".repeat(MAX_LISTED + 1)).unwrap_err();
        assert!(error.ends_with("way.csv: 1 more mistake"), "{error}");
    }
}
