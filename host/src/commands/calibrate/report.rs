//! Report of a calibration for people and as JSON.

use std::path::PathBuf;

use nalgebra::Isometry3;
use plumb_calibrate::calibration::{Calibration, Grade, Sample};
use serde::Serialize;

/// Way of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Way {
    /// A printed board at a known place.
    Board,
    /// The pixels of the motors, with depth.
    Motors,
    /// Known places of the ball.
    Ball,
}

impl Way {
    /// Returns the name of its option.
    pub(super) fn option(self) -> &'static str {
        match self {
            Self::Board => "board",
            Self::Motors => "motors",
            Self::Ball => "ball",
        }
    }
}

/// Outlying samples that are listed.
const MAX_LISTED: usize = 8;

/// Error that no number of a board's calibration shows.
const PLACE_OF_THE_BOARD: &str = "the errors do not include that of the board's own place: a \
     board that is turned by 1 degree turns the pose by 1 degree";

/// Result as a line of JSON. Lengths in metres, angles in degrees.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    way: Way,
    grade: String,
    translation: [f64; 3],
    /// x, y, z, w.
    quaternion: [f64; 4],
    position_sd_m: f64,
    rotation_sd_deg: f64,
    samples: usize,
    residual_m: f64,
    held_out_m: Option<f64>,
    outliers: Vec<String>,
    /// Change against the camera file.
    moved_m: f64,
    turned_deg: f64,
    findings: Vec<String>,
    /// The kept picture.
    pub(super) picture: Option<PathBuf>,
    /// Whether the camera file is written.
    pub(super) written: bool,
}

impl Report {
    /// Makes the report of a result, against the pose in the camera file.
    pub(super) fn new(way: Way, calibration: &Calibration, old: &Isometry3<f64>) -> Self {
        let Calibration { pose, position_sd, rotation_sd, samples, findings } = calibration;
        let (translation, quaternion) = (pose.translation.vector, pose.rotation.coords);
        let outlier = |sample: &Sample| {
            format!("{} is off by {:.0} mm and left out", sample.name, sample.residual * 1e3)
        };
        let mut findings = findings.clone();
        if way == Way::Board {
            findings.push(PLACE_OF_THE_BOARD.to_owned());
        }
        findings.extend(advice(calibration, way));
        Self {
            way,
            grade: calibration.grade().to_string(),
            translation: translation.into(),
            quaternion: quaternion.into(),
            position_sd_m: *position_sd,
            rotation_sd_deg: rotation_sd.to_degrees(),
            samples: samples.len(),
            residual_m: calibration.residual(),
            held_out_m: calibration.held_out(),
            outliers: calibration.outliers().map(outlier).collect(),
            moved_m: (translation - old.translation.vector).norm(),
            turned_deg: pose.rotation.angle_to(&old.rotation).to_degrees(),
            findings,
            picture: None,
            written: false,
        }
    }

    /// Prints the report for a person.
    pub(super) fn tell(&self) {
        for (index, line) in self.lines().iter().enumerate() {
            let indent = if index == 0 { "" } else { "  " };
            tell!("{indent}{line}");
        }
        if let Some(picture) = &self.picture {
            let picture = picture.display();
            tell!("  picture: {picture} (red x, green y, blue z must be where your rig has them)");
        }
    }

    /// Returns the report for a person: the grade, then a line for each number and note.
    pub(super) fn lines(&self) -> Vec<String> {
        let [x, y, z] = self.translation;
        let [i, j, k, w] = self.quaternion;
        let used = self.samples - self.outliers.len();
        let (position, rotation) = (self.position_sd_m * 1e3, self.rotation_sd_deg);
        let held_out =
            self.held_out_m.map_or("none".to_owned(), |it| format!("{:.1} mm", it * 1e3));
        let residual = self.residual_m * 1e3;
        let (moved, turned) = (self.moved_m * 1e3, self.turned_deg);
        let mut lines = vec![
            format!("pose: {} ({used} of {} samples used)", self.grade, self.samples),
            format!("translation [{x:.4}, {y:.4}, {z:.4}] m"),
            format!("quaternion  [{i:.5}, {j:.5}, {k:.5}, {w:.5}] (x, y, z, w)"),
            format!("standard deviation: {position:.1} mm near the samples, {rotation:.2} degrees"),
            format!("residual {residual:.1} mm, of held-out samples {held_out}"),
            format!(
                "against the camera file: moved by {moved:.0} mm, turned by {turned:.1} degrees"
            ),
        ];
        lines.extend(self.outliers.iter().take(MAX_LISTED).map(|it| format!("outlier: {it}")));
        lines.extend(self.findings.iter().map(|it| format!("note: {it}")));
        lines
    }
}

/// Returns what to do next.
fn advice(calibration: &Calibration, way: Way) -> Option<String> {
    let what = match way {
        Way::Board => {
            "move the board nearer to the camera, tilt it against the line of sight by 20 degrees \
             or more, glue it flat, and avoid reflections"
        }
        Way::Motors => {
            "choose the pixels where the cables leave the motors again, compare the sides of the \
             triangle with a rule, or use --board or --ball"
        }
        Way::Ball => {
            "add places of the ball, spread over the whole workspace and its height, and measure \
             to the ball's centre"
        }
    };
    match calibration.grade() {
        Grade::Good => None,
        Grade::Usable => Some(format!("for a better pose: {what}")),
        Grade::Poor => Some(format!("this pose is not written, for it is too uncertain: {what}")),
    }
}
