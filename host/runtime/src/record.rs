//! The records of a run as its outputs show them: a field has one name, one unit and one rounding
//! in `run.csv`, on the page, in MCAP files and for viewers. It is written here alone.

use plumb_protocol::MotorList;
use plumb_protocol::message::State;
use serde::{Serialize, Serializer};

use crate::board_report::{BoardReport, driver_warnings, near_slack};
use crate::observer::FrameRecord;
use crate::rounding::round;

/// Field of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Name, with its unit: the key in JSON, and the column of `run.csv`.
    pub name: &'static str,
    /// Value.
    pub value: Value,
    /// Meaning, for the schemas of viewers.
    pub meaning: &'static str,
}

/// Value of a field. `None` is unknown: `null` in JSON, and empty in `run.csv`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// Whole number.
    Count(Option<u64>),
    /// Number.
    Number(Option<f64>),
    /// Text.
    Text(Option<String>),
    /// Coordinates x, y, z.
    Point(Option<[f64; 3]>),
    /// Numbers of the motors or cables.
    Motors(Option<MotorList<f64>>),
    /// Readings of the motors' drivers, some of which may be unknown.
    Readings(Option<MotorList<Option<u16>>>),
    /// Marks of the cables.
    Marks(Option<MotorList<bool>>),
    /// Matrix of three rows, row by row.
    Matrix(Option<[f64; 9]>),
}

/// Fields of a record, in their order. As JSON an object.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Record(pub Vec<Field>);

impl Serialize for Record {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|field| (field.name, &field.value)))
    }
}

/// Returns the number of a frame, the first field of its record.
pub fn frame_number(record: &FrameRecord) -> Field {
    let value = Value::Count(Some(record.number));
    Field { name: "frame", value, meaning: "Number of the frame, from 0" }
}

/// Returns the record of the measurement in a frame.
pub fn observation(record: &FrameRecord) -> Record {
    use Value::{Matrix, Motors, Number};
    let ball = record.observation;
    let circle = ball.map(|ball| ball.circle);
    let covariance = ball.and_then(|ball| ball.position).map(|position| position.covariance);
    let covariance = covariance.map(|matrix| std::array::from_fn(|i| matrix[(i / 3, i % 3)]));
    let (path, position) = (record.path, record.position());
    let pace = path.map(|path| round(path.pace, 1e3));
    let along = path.zip(position).map(|(path, position)| path.along_track(position));
    let cross = path.zip(position).map(|(path, position)| path.cross_track(position));
    let tensions = record.ground_truth.map(|truth| thousandths(MotorList::new(truth.tensions)));
    let mut fields = record_of([
        ("time_s", number(Some(record.time)), "Time since the first frame of the run, s"),
        ("u_px", number(circle.map(|it| it.u)), "Column of the centre of the ball's disc, pixels"),
        ("v_px", number(circle.map(|it| it.v)), "Row of the centre of the ball's disc, pixels"),
        ("radius_px", number(circle.map(|it| it.radius)), "Radius of the ball's disc, pixels"),
        ("score", number(ball.map(|it| it.score)), "The detector's score; larger is surer"),
        ("position_m", point(position), "Measured position of the ball in the rig frame, m"),
        ("covariance_m2", Matrix(covariance), "Covariance of the position, row by row, m²"),
        ("target_m", point(record.target), "Target in the rig frame, m; the place on a path"),
        ("error_m", number(record.error()), "Distance of the position from the target, m"),
        ("true_tensions_weights", Motors(tensions), "Tensions of a simulated rig, ball's weights"),
        ("path_time_s", number(path.map(|it| it.time)), "Time of the path at the frame, s"),
        ("path_pace", Number(pace), "Speed of the path's time; 1 where motors and ball keep up"),
        ("along_track_m", number(along), "How far the ball is ahead along the path, m"),
        ("cross_track_m", number(cross), "Distance of the ball across the path, m"),
    ]);
    fields.0.insert(0, frame_number(record));
    fields
}

/// Returns the record of the board at a frame, from its newest telemetry.
pub fn telemetry(record: &FrameRecord) -> Record {
    use Value::{Count, Marks, Motors, Readings, Text};
    let (board, fault) = (record.board, record.board_fault());
    let count = |of: fn(BoardReport) -> Option<u16>| Count(board.and_then(of).map(u64::from));
    let motors = |of: fn(BoardReport) -> MotorList<f64>| Motors(board.map(|it| of(it).map(micro)));
    let state = |state: Option<State>| Text(state.map(state_name));
    let advice = fault.map(|fault| fault.advice().to_owned());
    let error = board.filter(|_| record.filtered_error.is_some()).map(|it| it.error);
    let tensions = board.and_then(|it| it.tensions);
    let reference = board.and_then(|it| it.reference);
    let drivers = board.and_then(|it| it.drivers);
    let loads = drivers.map(|drivers| drivers.map(|driver| driver.stall_guard));
    let warnings = drivers.map(|drivers| driver_warnings(&drivers));
    record_of([
        ("state", state(board.map(|it| it.state)), "State of the board"),
        ("target_state", state(record.board_state()), "The same, about the present target"),
        ("fault", Text(fault.map(|it| it.to_string())), "Why the board has stopped by itself"),
        ("advice", Text(advice), "What to do after the fault"),
        ("board_time_s", number(board.map(|it| it.time)), "Time on the board's clock, s"),
        ("configuration", count(|it| it.configuration), "Id of the configuration in force"),
        ("target", count(|it| it.target), "Id of the target in force"),
        ("sequence", count(|it| it.sequence), "Number of the last accepted position"),
        ("motors_steps", motors(|it| it.motors), "Motor positions, full steps; + pays out"),
        ("rates_steps_s", motors(|it| it.rates), "Motor rates, full steps/s; + pays out"),
        ("error_vector_m", point(error), "Last accepted position minus target, m"),
        ("filtered_error_m", number(record.filtered_error), "Length of the filtered error, m"),
        ("bad_frames", count(|it| Some(it.bad_frames)), "Damaged frames that the board received"),
        ("late_ticks", count(|it| Some(it.late_ticks)), "Ticks that came late in motion"),
        ("tensions_weights", Motors(tensions.map(thousandths)), "Estimated tensions, weights"),
        ("near_slack", Marks(tensions.map(near_slack)), "Whether each cable is near slack"),
        ("reference_m", point(reference), "Reference that the board follows, m"),
        ("stall_guard", Readings(loads), "StallGuard's readings; lower at a higher load"),
        ("driver_warnings", Text(warnings), "Warnings of drivers on a UART, such as A hot"),
    ])
}

fn record_of<const N: usize>(rows: [(&'static str, Value, &'static str); N]) -> Record {
    Record(rows.map(|(name, value, meaning)| Field { name, value, meaning }).into())
}

/// Returns a number of at most six digits after the point: micrometres, microseconds, and less than
/// the board's unit of a motor position (1/16 step).
fn number(value: Option<f64>) -> Value {
    Value::Number(value.map(micro))
}

fn point(value: Option<impl Into<[f64; 3]>>) -> Value {
    Value::Point(value.map(|it| it.into().map(micro)))
}

fn micro(value: f64) -> f64 {
    // Zero is added to write -0 as 0.
    round(value, 1e6) + 0.0
}

/// Rounds tensions. The board's unit is 1/256 of the ball's weight.
fn thousandths(values: MotorList<f64>) -> MotorList<f64> {
    values.map(|value| round(value, 1e3) + 0.0)
}

/// Returns the name of a state, without the fault.
fn state_name(state: State) -> String {
    match state {
        State::Fault(_) => "fault".to_owned(),
        state => state.to_string(),
    }
}
