//! A row of `run.csv`.

use nalgebra::Point3;
use plumb_frame::observation::BallObservation;
use plumb_protocol::message::{DriverReading, State};
use plumb_runtime::board_report::{driver_warnings, near_slack};
use plumb_runtime::observer::FrameRecord;
use plumb_runtime::rounding::round;

/// Everything that is known of one frame. A field that is `None` is left empty in the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LogRow {
    /// Number of the frame, from 0.
    pub frame: u64,
    /// Its time stamp, seconds since the run's start.
    pub t_s: f64,
    /// The ball as detected in the frame.
    pub detection: Option<LogDetection>,
    /// The ball as measured, metres in the rig frame.
    pub position: Option<Point3<f64>>,
    /// The target, metres in the rig frame.
    pub target: Option<Point3<f64>>,
    /// |e|, the distance of the measured position from the target, metres.
    pub error_m: Option<f64>,
    /// State of the board, if its telemetry is about the target or it has stopped by itself.
    pub board: Option<State>,
    /// Motor positions, full steps from the zero of travel, + pays out; order A, B, C.
    pub motors_steps: Option<[f64; 3]>,
    /// Motor rates, full steps a second, + pays out; order A, B, C.
    pub rates_steps_s: Option<[f64; 3]>,
    /// The law's estimate of the cables' tensions over the ball's weight; order A, B, C.
    pub tensions: Option<[f64; 3]>,
    /// Tensions of the simulated rig over the ball's weight; order A, B, C.
    pub true_tensions: Option<[f64; 3]>,
    /// The path that the ball follows, if it does.
    pub path: Option<LogPath>,
    /// Readings of the motor drivers; order A, B, C. `None` of drivers without a UART.
    pub drivers: Option<[DriverReading; 3]>,
}

/// A path and the ball's deviation from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogPath {
    /// Time of the path, seconds.
    pub time: f64,
    /// Speed of the path's time.
    pub pace: f64,
    /// How far the measured position is ahead along the path, metres.
    pub along_m: Option<f64>,
    /// Distance of the measured position across the path, metres.
    pub cross_m: Option<f64>,
}

/// The ball in the image, as in [`BallObservation`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogDetection {
    /// Column of its centre, pixels.
    pub u: f64,
    /// Row of its centre, pixels.
    pub v: f64,
    /// Radius of its disc, pixels.
    pub radius: f64,
    /// The detector's score.
    pub score: f64,
}

impl From<BallObservation> for LogDetection {
    fn from(BallObservation { circle, score, .. }: BallObservation) -> Self {
        Self { u: circle.u, v: circle.v, radius: circle.radius, score }
    }
}

impl From<&FrameRecord> for LogRow {
    fn from(record: &FrameRecord) -> Self {
        let board = record.board;
        Self {
            frame: record.number,
            t_s: record.time,
            detection: record.observation.map(Into::into),
            position: record.position(),
            target: record.target,
            error_m: record.error(),
            board: record.board_state(),
            motors_steps: board.map(|board| board.motors),
            rates_steps_s: board.map(|board| board.rates),
            tensions: board.and_then(|board| board.tensions),
            true_tensions: record.ground_truth.map(|truth| truth.tensions),
            path: record.path.map(|path| LogPath {
                time: path.time,
                pace: path.pace,
                along_m: record.position().map(|position| path.along_track(position)),
                cross_m: record.position().map(|position| path.cross_track(position)),
            }),
            drivers: board.and_then(|board| board.drivers),
        }
    }
}

/// Most digits after the point: micrometres, microseconds, and less than the board's unit of a
/// motor position (1/16 step) or a rate (1/256 step/s).
const DIGITS: i32 = 6;

/// Most digits after the point of a tension: the board's unit is 1/256 of the ball's weight.
const TENSION_DIGITS: i32 = 3;

/// Most digits after the point of a pace: the board's unit is 1/256.
const PACE_DIGITS: i32 = 3;

/// Returns the text of a number with at most [`DIGITS`] after the point; empty for `None`.
fn text(value: Option<f64>) -> String {
    text_with(DIGITS)(value)
}

/// Returns the function that writes a number with at most this many `digits` after the point,
/// without trailing zeros; empty for `None`.
fn text_with(digits: i32) -> impl Fn(Option<f64>) -> String {
    // Zero is added to write -0 as 0.
    move |value| {
        value.map(|value| (round(value, 10_f64.powi(digits)) + 0.0).to_string()).unwrap_or_default()
    }
}

/// Returns the letters of the cables near slack, `none` for no cable; empty without an estimate.
fn near_slack_text(tensions: Option<[f64; 3]>) -> String {
    let Some(tensions) = tensions else { return String::new() };
    let marks = near_slack(tensions).into_iter().zip("ABC".chars());
    let letters: String = marks.filter_map(|(near, cable)| near.then_some(cable)).collect();
    if letters.is_empty() { "none".to_owned() } else { letters }
}

impl LogRow {
    /// Names of the columns, with their units.
    pub const HEADER: [&'static str; 35] = [
        "frame",
        "t_s",
        "u_px",
        "v_px",
        "radius_px",
        "score",
        "x_m",
        "y_m",
        "z_m",
        "target_x_m",
        "target_y_m",
        "target_z_m",
        "error_m",
        "board",
        "motor_a_steps",
        "motor_b_steps",
        "motor_c_steps",
        "rate_a_steps_s",
        "rate_b_steps_s",
        "rate_c_steps_s",
        "tension_a_weights",
        "tension_b_weights",
        "tension_c_weights",
        "near_slack",
        "true_tension_a_weights",
        "true_tension_b_weights",
        "true_tension_c_weights",
        "path_time_s",
        "path_pace",
        "along_track_m",
        "cross_track_m",
        "stall_guard_a",
        "stall_guard_b",
        "stall_guard_c",
        "driver_warnings",
    ];

    /// Returns the fields in the order of [`LogRow::HEADER`].
    pub(crate) fn fields(&self) -> Vec<String> {
        let three = |values: Option<[f64; 3]>| values.map_or([None; 3], |v| v.map(Some));
        let detection =
            self.detection.map_or([None; 4], |d| [d.u, d.v, d.radius, d.score].map(Some));

        let mut fields = vec![self.frame.to_string(), text(Some(self.t_s))];
        fields.extend(detection.map(text));
        fields.extend(three(self.position.map(Into::into)).map(text));
        fields.extend(three(self.target.map(Into::into)).map(text));
        fields.push(text(self.error_m));
        fields.push(self.board.map(|state| state.to_string()).unwrap_or_default());
        fields.extend(three(self.motors_steps).map(text));
        fields.extend(three(self.rates_steps_s).map(text));
        fields.extend(three(self.tensions).map(text_with(TENSION_DIGITS)));
        fields.push(near_slack_text(self.tensions));
        fields.extend(three(self.true_tensions).map(text_with(TENSION_DIGITS)));
        let path = self.path;
        fields.push(text(path.map(|path| path.time)));
        fields.push(text_with(PACE_DIGITS)(path.map(|path| path.pace)));
        fields.push(text(path.and_then(|path| path.along_m)));
        fields.push(text(path.and_then(|path| path.cross_m)));
        let readings = self.drivers.map_or([None; 3], |it| it.map(|driver| driver.stall_guard));
        fields.extend(readings.map(|it| it.map(|it| it.to_string()).unwrap_or_default()));
        fields.push(self.drivers.as_ref().map(driver_warnings).unwrap_or_default());
        fields
    }
}
