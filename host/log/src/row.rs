//! Rows of `run.csv`, from the records of the run.

use plumb_protocol::MotorList;
use plumb_runtime::board_report::MOTOR_NAMES;
use plumb_runtime::observer::FrameRecord;
use plumb_runtime::record::{Field, Value, observation, telemetry};

/// Returns the names of the columns, with their units.
pub fn columns() -> Vec<String> {
    let parts = |field: &Field| match field.value {
        Value::Point(_) => vec!["_x", "_y", "_z"],
        Value::Motors(_) | Value::Readings(_) => vec!["_a", "_b", "_c"],
        Value::Matrix(_) => Vec::new(),
        Value::Count(_) | Value::Number(_) | Value::Text(_) | Value::Marks(_) => vec![""],
    };
    let names =
        |field: Field| parts(&field).into_iter().map(move |part| [field.name, part].concat());
    fields(&FrameRecord::default()).flat_map(names).collect()
}

/// Returns the row of a frame: a text for each column.
pub(crate) fn row(record: &FrameRecord) -> Vec<String> {
    fields(record).flat_map(|field| texts(field.value)).collect()
}

fn fields(record: &FrameRecord) -> impl Iterator<Item = Field> {
    observation(record).0.into_iter().chain(telemetry(record).0)
}

/// Returns the texts of a value in its columns; empty for a motor that the rig has not. A matrix
/// has none.
fn texts(value: Value) -> Vec<String> {
    match value {
        Value::Count(count) => vec![text(count)],
        Value::Number(number) => vec![text(number)],
        Value::Text(words) => vec![text(words)],
        Value::Point(parts) => parts.map_or([None; 3], |parts| parts.map(Some)).map(text).into(),
        Value::Motors(parts) => {
            parts.map(|parts| parts.map(Some)).unwrap_or_default().steppable(None).map(text).into()
        }
        Value::Readings(parts) => parts.unwrap_or_default().steppable(None).map(text).into(),
        Value::Marks(marks) => vec![text(marks.map(letters))],
        Value::Matrix(_) => Vec::new(),
    }
}

fn text(value: Option<impl ToString>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

/// Returns the letters of the marked cables; `none` for no cable.
fn letters(marks: MotorList<bool>) -> String {
    let marked = marks.iter().zip(MOTOR_NAMES).filter(|(is_marked, _)| **is_marked);
    let letters: String = marked.map(|(_, cable)| cable).collect();
    if letters.is_empty() { "none".to_owned() } else { letters }
}
