//! JSON messages of a run. Their schemas are in `host/foxglove/schemas/`.

use plumb_runtime::board_report::{BoardReport, driver_warnings};
use plumb_runtime::observer::{FrameRecord, PathPoint};
use serde::Serialize;

/// Measurement of one frame. `null` is unknown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Observation {
    /// Number of the frame, from 0.
    pub(crate) frame: u64,
    /// Seconds since the run's start.
    pub(crate) time_s: f64,
    /// The ball in the image; `None` if it was not found.
    pub(crate) circle_px: Option<CircleMessage>,
    /// The detector's score.
    pub(crate) score: Option<f64>,
    /// Measured position, metres in the rig frame.
    pub(crate) position_m: Option<[f64; 3]>,
    /// Covariance of the position, metres², row by row.
    pub(crate) covariance_m2: Option<[f64; 9]>,
    /// The target, metres in the rig frame; `None` before the first one.
    pub(crate) target_m: Option<[f64; 3]>,
    /// Distance of the position from the target, metres.
    pub(crate) error_m: Option<f64>,
    /// Point of the path or of the moving target at the frame; `None` while the board follows none.
    pub(crate) reference: Option<ReferenceMessage>,
}

/// The ball's disc in the image, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct CircleMessage {
    pub(crate) u: f64,
    pub(crate) v: f64,
    pub(crate) radius: f64,
}

/// Reference that the board follows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct ReferenceMessage {
    /// Time of the path, seconds.
    pub(crate) time_s: f64,
    /// Speed of the path's time: 1 where the motors and the ball keep up.
    pub(crate) pace: f64,
    /// Place, metres in the rig frame.
    pub(crate) position_m: [f64; 3],
}

impl From<PathPoint> for ReferenceMessage {
    fn from(path: PathPoint) -> Self {
        Self { time_s: path.time, pace: path.pace, position_m: path.position.into() }
    }
}

impl From<&FrameRecord> for Observation {
    fn from(record: &FrameRecord) -> Self {
        let ball = record.observation;
        let circle = ball.map(|ball| ball.circle);
        let covariance = ball.and_then(|ball| ball.position).map(|position| position.covariance);
        Self {
            frame: record.number,
            time_s: record.time,
            circle_px: circle.map(|c| CircleMessage { u: c.u, v: c.v, radius: c.radius }),
            score: ball.map(|ball| ball.score),
            position_m: record.position().map(Into::into),
            covariance_m2: covariance.map(|matrix| std::array::from_fn(|i| matrix[(i / 3, i % 3)])),
            target_m: record.target.map(Into::into),
            error_m: record.error(),
            reference: record.path.map(Into::into),
        }
    }
}

/// Telemetry of the board. `null` is unknown or none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct TelemetryMessage {
    /// Number of the first frame after it.
    pub(crate) frame: u64,
    /// What the board tells of itself.
    #[serde(flatten)]
    pub(crate) board: BoardReport,
    /// What to do after the fault; `None` without a fault.
    pub(crate) advice: Option<&'static str>,
    /// Last accepted position minus target, metres; `None` without a target.
    pub(crate) error_m: Option<[f64; 3]>,
    /// |e| of the filtered position, metres; `None` without a target, and before the board has
    /// accepted a position of the ball.
    pub(crate) filtered_error_m: Option<f64>,
    /// Warnings of drivers on a UART in words; `None` of other drivers.
    pub(crate) driver_warnings: Option<String>,
}

impl TelemetryMessage {
    /// Makes the message of the `board` of a record.
    pub(crate) fn new(record: &FrameRecord, board: &BoardReport) -> Self {
        let filtered_error_m = record.filtered_error;
        Self {
            frame: record.number,
            board: *board,
            advice: record.board_fault().map(|fault| fault.advice()),
            error_m: filtered_error_m.map(|_| board.error),
            filtered_error_m,
            driver_warnings: board.drivers.as_ref().map(driver_warnings),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use nalgebra::Point3;
    use plumb_protocol::message::{DriverReading, State};
    use serde_json::{Value, json, to_value};

    use super::*;

    /// Returns the message of a board at rest with these readings of its drivers.
    fn message(drivers: Option<[DriverReading; 3]>) -> Value {
        let board = BoardReport {
            time: 0.0,
            state: State::Ready,
            configuration: None,
            target: None,
            sequence: None,
            motors: [0.0; 3],
            rates: [0.0; 3],
            error: [0.0; 3],
            bad_frames: 0,
            late_ticks: 0,
            tensions: None,
            reference: None,
            drivers,
        };
        let record = FrameRecord {
            target: Some(Point3::origin()),
            board: Some(board),
            ..FrameRecord::default()
        };
        to_value(TelemetryMessage::new(&record, &board)).unwrap()
    }

    #[test]
    fn the_warnings_of_drivers_are_in_the_telemetry() {
        let cool = DriverReading::default();
        let hot = DriverReading { is_hot: true, ..cool };
        let open = DriverReading { has_open_load: true, ..cool };
        let warnings = |drivers| message(drivers)["driver_warnings"].clone();
        assert_eq!(warnings(Some([hot, cool, open])), json!("A hot, C open coil"));
        assert_eq!(warnings(Some([cool; 3])), json!("none"));
        assert_eq!(warnings(None), Value::Null, "other drivers");
    }

    #[test]
    fn the_telemetry_has_the_fields_of_its_schema() {
        let schema: Value =
            serde_json::from_slice(include_bytes!("../schemas/telemetry.json")).unwrap();
        let message = message(None);
        let fields: BTreeSet<&str> = message.as_object().unwrap().keys().map(|it| &**it).collect();
        let properties = schema["properties"].as_object().unwrap();
        assert_eq!(fields, properties.keys().map(|it| &**it).collect());
        let required = schema["required"].as_array().unwrap();
        assert_eq!(fields, required.iter().map(|it| it.as_str().unwrap()).collect());
    }
}
