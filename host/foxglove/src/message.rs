//! Records of a run as JSON messages, and their schemas.

use std::ops::RangeInclusive;

use plumb_protocol::dimension::{LEAST_MOTORS, MOTORS};
use plumb_runtime::observer::FrameRecord;
use plumb_runtime::record::{Field, Record, Value, frame_number, telemetry};
use serde_json::{Map, json};

/// Returns the message of the board's telemetry, with the number of the first frame after it.
pub(crate) fn telemetry_message(record: &FrameRecord) -> Record {
    let Record(mut fields) = telemetry(record);
    fields.insert(0, frame_number(record));
    Record(fields)
}

/// Returns the JSON schema `title` of messages with the fields of `record`.
pub(crate) fn schema(title: &str, record: &Record) -> Vec<u8> {
    let names: Vec<&str> = record.0.iter().map(|field| field.name).collect();
    let properties: Map<_, _> =
        record.0.iter().map(|field| (field.name.to_owned(), property(field))).collect();
    let schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        "type": "object",
        "properties": properties,
        "required": names,
    });
    schema.to_string().into_bytes()
}

/// Returns the schema of a field; `null` is unknown.
fn property(Field { value, meaning, .. }: &Field) -> serde_json::Value {
    let list = |item: serde_json::Value, count: RangeInclusive<usize>| {
        let (items, least, most) = (json!({ "type": item }), count.start(), count.end());
        json!({"type": ["array", "null"], "items": items, "minItems": least, "maxItems": most})
    };
    let motors = LEAST_MOTORS..=MOTORS;
    let mut schema = match value {
        Value::Count(_) => json!({"type": ["integer", "null"]}),
        Value::Number(_) => json!({"type": ["number", "null"]}),
        Value::Text(_) => json!({"type": ["string", "null"]}),
        Value::Point(_) => list(json!("number"), 3..=3),
        Value::Motors(_) => list(json!("number"), motors),
        Value::Readings(_) => list(json!(["integer", "null"]), motors),
        Value::Marks(_) => list(json!("boolean"), motors),
        Value::Matrix(_) => list(json!("number"), 9..=9),
    };
    schema["description"] = json!(meaning);
    schema
}
