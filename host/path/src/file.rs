//! Places from files: tables of numbers, or G-code with straight motions.
//!
//! The columns of a table decide what it is, in any order. `x,y,z` are a path, also without names;
//! `t,x,y,z` are places with times; with `dwell` or `tolerance` the ball stops at each place.
//! Metres in the rig frame, and seconds. A line that is repeated is a pause. `u,v` in place of
//! `x,y,z` are pixels of the picture.

use nalgebra::Point3;
use plumb_config::mistake::{Kind as MistakeKind, Mistake};
use plumb_config::quantity::{Coordinate, PixelCoordinate, Range};

use crate::gcode;
use crate::table::{Row, Table, column_name};

pub use crate::places::{Kind, Place, Places, Unit};

/// Names of the columns.
const COLUMNS: [&str; 8] = ["t", "x", "y", "z", "dwell", "tolerance", "u", "v"];

/// Columns that a file of metres must have, by their places in [`COLUMNS`].
const METRES: std::ops::RangeInclusive<usize> = 1..=3;

/// Columns that a file of pixels must have.
const PIXELS: std::ops::RangeInclusive<usize> = 6..=7;

/// Columns of a table, for messages.
const ALLOWED: &str = "columns are x, y, z in metres, t in seconds, dwell in seconds, tolerance in \
                       metres; or u, v in pixels, t, dwell";

/// Range of a time: the whole path may take a day.
const TIME: Range = Range::new(-1e10, 1e10, "s");

/// Range of a dwell time: up to a day.
const DWELL: Range = Range::new(0.0, 86_400.0, "s");

/// Range of the distance at which a place counts as reached.
const TOLERANCE: Range = Range::above_zero(1.0, "m");

/// Parses the text of a file.
///
/// # Errors
/// All mistakes: wrong columns, lines with mistakes, no places.
pub fn parse(text: &str) -> Result<Places, Vec<Mistake>> {
    let mut mistakes = Vec::new();
    let found = match gcode::is_gcode(text) {
        true => gcode::parse(text, &mut mistakes),
        false => of_table(&Table::of(text, &COLUMNS), &mut mistakes),
    };
    if mistakes.is_empty() && found.places.is_empty() {
        mistakes.push(Mistake::of_line(1, format!("the file has no places; {ALLOWED}")));
    }
    if mistakes.is_empty() { Ok(found) } else { Err(mistakes) }
}

/// Returns the places of a table.
fn of_table(table: &Table, mistakes: &mut Vec<Mistake>) -> Places {
    let columns = columns(table, mistakes);
    let has = |name: &str| columns.iter().any(|&column| COLUMNS[column] == name);
    let kind = match (has("t"), has("dwell") || has("tolerance")) {
        (true, _) => Kind::Timed,
        (false, true) => Kind::Stops,
        (false, false) => Kind::Path,
    };
    let mut places: Vec<Place> = Vec::new();
    if mistakes.is_empty() {
        for row in &table.rows {
            let Some(place) = place(row, table, &columns, mistakes) else { continue };
            if kind == Kind::Timed && places.last().is_some_and(|it| place.time_s <= it.time_s) {
                let message = "is not above that of the line before";
                mistakes.push(wrong(row.line, "t", &place.time_s.to_string(), message));
            }
            places.push(place);
        }
    }
    let unit = if has("u") { Unit::Pixels } else { Unit::Metres };
    Places { unit, kind, places, speeds: Vec::new() }
}

/// Returns each column of a table by its place in [`COLUMNS`]. Three columns without names are x,
/// y, z.
fn columns(table: &Table, mistakes: &mut Vec<Mistake>) -> Vec<usize> {
    let Some(names) = &table.names else {
        match table.rows.first() {
            Some(first) if first.fields.len() > METRES.count() => {
                let count = first.fields.len();
                let message = format!("{count} columns need a first line with names; {ALLOWED}");
                mistakes.push(Mistake::of_line(first.line, message));
            }
            _ => {}
        }
        return METRES.collect();
    };
    let mut found = Vec::new();
    let mut mistake = |key: &str, kind, message: String| {
        let (key, value) = (key.to_owned(), String::new());
        mistakes.push(Mistake { line: names.line, key, value, kind, message });
    };
    for name in &names.fields {
        match COLUMNS.iter().position(|column| *column == column_name(name)) {
            Some(place) if found.contains(&place) => {
                mistake(name, MistakeKind::Wrong, "the column is there twice".to_owned());
            }
            Some(place) => found.push(place),
            None => mistake(name, MistakeKind::Unknown, format!("no such column; {ALLOWED}")),
        }
    }
    let has_pixels = found.iter().any(|column| PIXELS.contains(column));
    let needed = if has_pixels { PIXELS } else { METRES };
    for needed in needed.filter(|needed| !found.contains(needed)) {
        mistake(COLUMNS[needed], MistakeKind::Missing, String::new());
    }
    let has = |name: &str| found.iter().any(|&column| COLUMNS[column] == name);
    for name in ["x", "y", "z", "tolerance"].into_iter().filter(|name| has_pixels && has(name)) {
        mistake(name, MistakeKind::Wrong, "not in one file with u and v".to_owned());
    }
    if has("t") && (has("dwell") || has("tolerance")) {
        mistake("t", MistakeKind::Wrong, "not in one file with dwell or tolerance".to_owned());
    }
    found
}

/// Returns the place of a line. Adds its mistakes to `mistakes`; `None` if it has one.
fn place(
    row: &Row,
    table: &Table,
    columns: &[usize],
    mistakes: &mut Vec<Mistake>,
) -> Option<Place> {
    let (line, count, before) = (row.line, row.fields.len(), mistakes.len());
    if count > columns.len() {
        let message = format!("{count} columns, but the table has {}", columns.len());
        mistakes.push(Mistake::of_line(line, message));
        return None;
    }
    let mut values = [None; COLUMNS.len()];
    for (index, &column) in columns.iter().enumerate() {
        let field = row.fields.get(index).map_or("", String::as_str);
        let name = COLUMNS[column];
        let range = match name {
            "t" => TIME,
            "dwell" => DWELL,
            "tolerance" => TOLERANCE,
            "u" | "v" => PixelCoordinate::RANGE,
            _ => Coordinate::RANGE,
        };
        // Dwell time and tolerance may be left out.
        if field.is_empty() && matches!(name, "dwell" | "tolerance") {
            continue;
        }
        match table.number(field).map(|number| range.check(number)) {
            Some(Ok(number)) => values[column] = Some(number),
            Some(Err(error)) => mistakes.push(wrong(line, name, field, error)),
            None => mistakes.push(wrong(line, name, field, format!("must be a number, {range}"))),
        }
    }
    let [time, x, y, z, dwell, tolerance_m, u, v] = values;
    let position = match u.zip(v) {
        Some((u, v)) => Point3::new(0.0, u, v),
        None => Point3::new(x?, y?, z?),
    };
    let (time_s, dwell_s) = (time.unwrap_or_default(), dwell.unwrap_or_default());
    (mistakes.len() == before).then_some(Place { line, position, time_s, dwell_s, tolerance_m })
}

/// Returns the mistake of a value.
fn wrong(line: usize, name: &str, value: &str, message: impl ToString) -> Mistake {
    let kind = MistakeKind::Wrong;
    let (key, value) = (name.to_owned(), value.to_owned());
    Mistake { line, key, value, kind, message: message.to_string() }
}

#[cfg(test)]
mod tests;
