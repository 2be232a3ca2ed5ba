//! A row of `run.csv`.

use nalgebra::Point3;
use plumb_vision::observation::BallObservation;

/// What is known of one frame. A field that is `None` is left empty in the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// Number of the frame, from 0.
    pub frame: u64,
    /// When it was taken, seconds since the run's start.
    pub t_s: f64,
    /// The ball as detected in the picture.
    pub detection: Option<RowDetection>,
    /// The ball as measured, metres in the rig frame.
    pub position: Option<Point3<f64>>,
    /// Where it is to go, metres in the rig frame.
    pub target: Option<Point3<f64>>,
    /// |e|, the distance from the target, metres; the caller's choice of raw or filtered.
    pub error_m: Option<f64>,
    /// The board's state in a word, as it was last heard of; empty where it was not.
    pub board: String,
    /// Motor positions, full steps since the start, + pays out; order A, B, C.
    pub motors_steps: Option<[f64; 3]>,
    /// Motor rates, full steps a second, + pays out; order A, B, C.
    pub rates_steps_s: Option<[f64; 3]>,
}

/// Where the ball is in the picture; as in [`BallObservation`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowDetection {
    /// Column of its centre, pixels.
    pub u: f64,
    /// Row of its centre, pixels.
    pub v: f64,
    /// Radius of its disc, pixels.
    pub radius: f64,
    /// The detector's score.
    pub score: f64,
}

impl From<BallObservation> for RowDetection {
    fn from(BallObservation { circle, score, .. }: BallObservation) -> Self {
        Self { u: circle.u, v: circle.v, radius: circle.radius, score }
    }
}

impl Row {
    /// The names of the columns, with their units.
    pub const HEADER: [&'static str; 20] = [
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
    ];

    /// The row's fields in the order of [`Row::HEADER`]; numbers such that they read back the same.
    pub(crate) fn fields(&self) -> Vec<String> {
        let three = |values: Option<[f64; 3]>| values.map_or([None; 3], |v| v.map(Some));
        let detection =
            self.detection.map_or([None; 4], |d| [d.u, d.v, d.radius, d.score].map(Some));
        // Zero is added to write -0 as 0.
        let text = |value: Option<f64>| value.map(|v| (v + 0.0).to_string()).unwrap_or_default();

        let mut fields = vec![self.frame.to_string(), self.t_s.to_string()];
        fields.extend(detection.map(text));
        fields.extend(three(self.position.map(Into::into)).map(text));
        fields.extend(three(self.target.map(Into::into)).map(text));
        fields.push(text(self.error_m));
        fields.push(self.board.clone());
        fields.extend(three(self.motors_steps).map(text));
        fields.extend(three(self.rates_steps_s).map(text));
        fields
    }
}
