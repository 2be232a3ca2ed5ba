//! Result of a calibration: the pose, how well the samples agree, and what to do next.

use std::fmt;

use nalgebra::{Isometry3, Point3};
use thiserror::Error;

/// Pose of a camera, and how far it can be trusted.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// From camera axes (x right, y down, z forward) into the rig frame.
    pub pose: Isometry3<f64>,
    /// Standard deviation of a position near the samples, metres.
    pub position_sd: f64,
    /// Standard deviation of the rotation, radians.
    pub rotation_sd: f64,
    /// The samples, each with its residual.
    pub samples: Vec<Sample>,
    /// Observations that a person should know of, in plain words.
    pub findings: Vec<String>,
}

/// Corner, motor or place that a calibration used.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Name for a person: "corner 3", "motor A", "place 2".
    pub name: String,
    /// Known point, rig frame, metres.
    pub known: Point3<f64>,
    /// The point as the camera sees it, camera axes, metres.
    pub seen: Point3<f64>,
    /// Distance between the two with the calibration's pose, metres.
    pub residual: f64,
    /// The same distance with the pose that the other samples give, metres. `None` where the others
    /// do not determine one.
    pub held_out: Option<f64>,
    /// Whether the sample is left out as an outlier.
    pub is_outlier: bool,
}

/// Grade of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Grade {
    /// All laws drive as with the true pose.
    Good,
    /// Positions are off by more than needed, but the laws drive.
    Usable,
    /// Something is wrong: the pose should not be used.
    Poor,
}

/// Limits of the grades.
struct GradeLimits {
    /// Error of samples, root mean square, metres.
    error: f64,
    /// Standard deviation of the rotation, radians.
    rotation_sd: f64,
}

/// Limits of [`Grade::Good`]: the usual radius in which a target counts as reached, and a tenth of
/// the angle up to which no law is slower by more than 3 % (docs/use/calibrate.md).
const GOOD: GradeLimits = GradeLimits { error: 0.010, rotation_sd: 0.0175 };
/// Limits of [`Grade::Usable`].
const USABLE: GradeLimits = GradeLimits { error: 0.025, rotation_sd: 0.0524 };

impl GradeLimits {
    fn admit(&self, calibration: &Calibration) -> bool {
        calibration.error() <= self.error && calibration.rotation_sd <= self.rotation_sd
    }
}

impl Calibration {
    /// Returns the root mean square of the residuals of the samples that were used, metres.
    pub fn residual(&self) -> f64 {
        root_mean_square(self.used().map(|sample| sample.residual)).unwrap_or(0.0)
    }

    /// Returns the root mean square of the held-out residuals, metres; `None` if no sample could be
    /// held out.
    pub fn held_out(&self) -> Option<f64> {
        root_mean_square(self.used().filter_map(|sample| sample.held_out))
    }

    /// Returns the error that the grade is given for: that of held-out samples where there is one,
    /// metres.
    fn error(&self) -> f64 {
        self.held_out().unwrap_or(self.residual())
    }

    /// Returns the samples that were left out.
    pub fn outliers(&self) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(|sample| sample.is_outlier)
    }

    fn used(&self) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(|sample| !sample.is_outlier)
    }

    /// Returns the grade.
    pub fn grade(&self) -> Grade {
        if GOOD.admit(self) {
            Grade::Good
        } else if USABLE.admit(self) {
            Grade::Usable
        } else {
            Grade::Poor
        }
    }
}

/// Returns the root of the mean of squares; `None` of no numbers.
fn root_mean_square(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0), |(sum, n), x| (sum + x * x, n + 1));
    (n > 0).then(|| (sum / f64::from(n)).sqrt())
}

impl fmt::Display for Grade {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Good => "good",
            Self::Usable => "usable",
            Self::Poor => "poor",
        })
    }
}

/// Reasons why samples do not determine a pose.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// There are too few samples.
    #[error("too few {what}: {found}, and {needed} are needed")]
    TooFew {
        /// Kind of the samples, "places of the ball".
        what: &'static str,
        /// Number of samples.
        found: usize,
        /// Least number.
        needed: usize,
    },
    /// The samples lie on a line: the camera may be turned about it.
    #[error(
        "{what} lie on a line (they are only {} mm off it): the camera may be turned about that \
         line. {advice} {} mm or more to the side", mm(.off), mm(.needed)
    )]
    OnALine {
        /// Kind of the samples, "the places of the ball".
        what: &'static str,
        /// What to do, up to the distance.
        advice: &'static str,
        /// Root mean square of the distance from the line, metres.
        off: f64,
        /// Distance that is needed, metres.
        needed: f64,
    },
    /// The samples lie in a plane: a mirrored frame fits as well.
    #[error(
        "the places of the ball lie in a plane (they are only {} mm off it): a mirrored frame fits \
         them as well. Add a place {} mm or more above or below the others", mm(.off), mm(.needed)
    )]
    InAPlane {
        /// Root mean square of the distance from the plane, metres.
        off: f64,
        /// Distance that is needed, metres.
        needed: f64,
    },
    /// The known points are those of a mirrored frame.
    #[error(
        "the known points are mirrored against what the camera sees: an axis points the wrong way, \
         or two coordinates are swapped. In the rig frame z points up, y from motor B to motor A, \
         and motor C has the smallest x"
    )]
    Mirrored,
    /// The samples contradict each other.
    #[error(
        "the samples contradict each other: {}. Measure the worst again, or add further ones: with \
         more samples a wrong one is found and left out",
        list(.residuals)
    )]
    Inconsistent {
        /// Name and residual (metres) of each sample with the pose of all.
        residuals: Vec<(String, f64)>,
    },
    /// The motors are not where their letters put them.
    #[error("{reason}; check which motor is A, B and C")]
    Letters {
        /// What is wrong.
        reason: &'static str,
    },
    /// A sample moved while it was measured.
    #[error(
        "{what} moved by {pixels:.1} pixels between the pictures: hold camera and {what} still"
    )]
    Moved {
        /// What moved, "the board".
        what: &'static str,
        /// Standard deviation over the pictures, pixels.
        pixels: f64,
    },
    /// Two poses explain the samples equally well.
    #[error(
        "two poses explain the picture of the board about equally well: tilt the board against the \
         line of sight by 20 degrees or more, or move it nearer to the camera"
    )]
    Ambiguous,
    /// A motor has no depth.
    #[error(
        "no depth at motor {motor} (column {:.0}, row {:.0}): {}",
        .pixel[0], .pixel[1], other_pixel(*.is_outside)
    )]
    NoDepth {
        /// Letter of the motor.
        motor: char,
        /// Column and row, pixels.
        pixel: [f64; 2],
        /// Whether the pixel is outside the picture.
        is_outside: bool,
    },
    /// The numerical search found no pose.
    #[error("the samples do not determine a pose: use samples that are farther apart")]
    Undetermined,
}

/// Returns what to do about a pixel without depth.
fn other_pixel(is_outside: bool) -> &'static str {
    if is_outside {
        "that is outside the picture. Without --pixel the picture is kept: read the pixel there"
    } else {
        "choose a pixel on a matt surface facing the camera, 0.4 m or more away. A camera without \
         depth takes --board or --ball"
    }
}

/// Formats metres as millimetres.
fn mm(metres: &f64) -> String {
    format!("{:.0}", metres * 1e3)
}

/// Formats names with their residuals.
fn list(samples: &[(String, f64)]) -> String {
    let texts: Vec<_> =
        samples.iter().map(|(name, error)| format!("{name} is off by {} mm", mm(error))).collect();
    texts.join(", ")
}
