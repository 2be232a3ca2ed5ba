//! Result of the calibration of a lens: how far it can be trusted, and what to do next.

use nalgebra::{Isometry3, Point2, Point3};
use plumb_frame::camera::Intrinsics;

use super::coverage::Coverage;
use super::{GOOD_VIEWS, median};
use crate::board_pose::SeenCorner;
use crate::calibration::Grade;

/// A view whose residual is above so many medians of all views is reported.
const BAD_VIEW_MEDIANS: f64 = 2.5;
/// Coverage below which the empty regions are reported.
const GOOD_COVERAGE: f64 = 0.7;

/// Limits of the grades.
struct GradeLimits {
    /// Error on held-out views, root mean square, pixels.
    error: f64,
    /// Standard deviation of the focal length, as a share of it.
    focal_sd: f64,
    /// Part of the picture in which corners were seen.
    coverage: f64,
}

/// Limits of [`Grade::Good`]: the error is small against the radius of a ball, and 0.3 % of the
/// focal length are 3 mm in a metre.
const GOOD: GradeLimits = GradeLimits { error: 0.5, focal_sd: 0.003, coverage: 0.6 };
/// Limits of [`Grade::Usable`].
const USABLE: GradeLimits = GradeLimits { error: 1.0, focal_sd: 0.01, coverage: 0.4 };

/// Intrinsics of a lens, and how far they can be trusted.
#[derive(Debug, Clone, PartialEq)]
pub struct LensCalibration {
    /// Intrinsics with the distortion, without depth.
    pub intrinsics: Intrinsics,
    /// Standard deviation of the focal lengths: the larger one, pixels.
    pub focal_sd: f64,
    /// Standard deviation of the principal point: the larger one, pixels.
    pub centre_sd: f64,
    /// Root mean square of the distances of the corners from their images, pixels.
    pub rms: f64,
    /// The same on views that were held out, whose poses alone were fitted, pixels.
    pub held_out: f64,
    /// Part of the picture in which corners were seen, 0 to 1.
    pub coverage: f64,
    /// The views that were used.
    pub views: Vec<ViewFit>,
    /// Number of corners that were left out.
    pub outliers: usize,
    /// What a person should know or do, in plain words.
    pub findings: Vec<String>,
}

/// A view and its residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewFit {
    /// Name of the picture.
    pub name: String,
    /// Pose of the board: from board axes into camera axes.
    pub pose: Isometry3<f64>,
    /// Root mean square of the distances of the corners from their images, pixels.
    pub rms: f64,
    /// The corners that were used.
    pub corners: Vec<SeenCorner>,
}

impl LensCalibration {
    /// Returns the grade. A poor lens should not be used.
    pub fn grade(&self) -> Grade {
        let admits = |limits: &GradeLimits| {
            self.held_out <= limits.error
                && self.focal_sd <= limits.focal_sd * self.intrinsics.focal()
                && self.coverage >= limits.coverage
        };
        match (admits(&GOOD), admits(&USABLE)) {
            (true, _) => Grade::Good,
            (_, true) => Grade::Usable,
            _ => Grade::Poor,
        }
    }
}

impl ViewFit {
    /// Returns where the fit puts each corner, pixels; `None` for one that the lens does not see.
    pub fn expected(&self, lens: &Intrinsics) -> Vec<Option<Point2<f64>>> {
        let place = |corner: &SeenCorner| {
            let point = self.pose * Point3::new(corner.board.x, corner.board.y, 0.0);
            lens.project(&point).map(|(u, v)| Point2::new(u, v))
        };
        self.corners.iter().map(place).collect()
    }
}

/// Says what was seen and what to do next.
pub(super) fn findings(calibration: &LensCalibration, coverage: &Coverage) -> Vec<String> {
    let mut findings = Vec::new();
    let count = calibration.views.len();
    if count < GOOD_VIEWS {
        findings.push(format!("{count} pictures are few: take {GOOD_VIEWS} or more"));
    }
    if coverage.part < GOOD_COVERAGE {
        let percent = 100.0 * coverage.part;
        let where_to = match coverage.empty.is_empty() {
            true => ": show the board nearer to the edges".to_owned(),
            false => format!("{}: show the board there", list(&coverage.empty)),
        };
        findings.push(format!(
            "corners of the board were seen in {percent:.0} % of the picture{where_to}"
        ));
    }
    if calibration.focal_sd > GOOD.focal_sd * calibration.intrinsics.focal() {
        findings.push(
            "the focal length is uncertain: tilt the board by 30 degrees and more to all sides"
                .to_owned(),
        );
    }
    let usual = median(calibration.views.iter().map(|view| view.rms).collect());
    let is_bad = |view: &&ViewFit| view.rms > BAD_VIEW_MEDIANS * usual.max(0.05);
    findings.extend(calibration.views.iter().filter(is_bad).map(|view| {
        format!(
            "{} fits worse than the others ({:.2} px): leave it out if it is blurred or the board \
             was bent",
            view.name, view.rms
        )
    }));
    if calibration.held_out > GOOD.error {
        findings.push(
            "the error is large: glue the board onto something flat, hold it still, and light it \
             so that no picture is blurred"
                .to_owned(),
        );
    }
    findings
}

/// Lists regions without corners.
pub(super) fn list(empty: &[&'static str]) -> String {
    if empty.is_empty() { String::new() } else { format!(", none at the {}", empty.join(", ")) }
}
