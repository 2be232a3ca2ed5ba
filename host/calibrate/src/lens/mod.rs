//! Intrinsics and distortion of a lens from views of the printed board.
//!
//! The corners of the board in all views determine the lens and the pose of the board in each view:
//! the least squares of the distances in the pictures (Zhang's method). The coefficient k3 is free
//! only where it makes the error on held-out views smaller: a polynomial of a high order follows
//! the noise where no corner was seen.

mod bundle;
mod coverage;
mod start;

use nalgebra::{Isometry3, Point2, Point3};
use plumb_frame::camera::{DistortionError, Intrinsics};
use plumb_frame::image::ImageSize;
use thiserror::Error;

use crate::board_pose::MIN_CORNERS;
use crate::board_view::SeenCorner;
use crate::calibration::Grade;
use bundle::{ALL, FIRST, Fit, WITHOUT_K3, intrinsics, minimise, residuals};
use coverage::Coverage;

/// Least number of views.
pub const MIN_VIEWS: usize = 5;
/// Number of views below which more are advised.
const GOOD_VIEWS: usize = 12;
/// Groups of views that are held out in turn.
const FOLDS: usize = 4;
/// Decrease of the held-out error for which k3 is free, as a share.
const K3_GAIN: f64 = 0.02;
/// A corner whose residual is above so many medians of all residuals, and above
/// [`LEAST_OUTLIER`], is an outlier.
const OUTLIER_MEDIANS: f64 = 6.0;
/// Least residual of an outlier, pixels.
const LEAST_OUTLIER: f64 = 1.0;
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

/// The board in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct LensView {
    /// Name of the picture for a person.
    pub name: String,
    /// Corners of the board, pixels.
    pub corners: Vec<SeenCorner>,
}

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

/// Reason why views give no lens.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LensError {
    /// There are too few views with enough corners.
    #[error(
        "the board is seen well enough in {found} pictures, {MIN_VIEWS} are needed, better \
         {GOOD_VIEWS} or more: take pictures with all of the board, tilted and in every part of \
         the picture"
    )]
    TooFewViews {
        /// Views with enough corners.
        found: usize,
    },
    /// The views do not determine the lens.
    #[error(
        "the pictures do not determine the lens: tilt the board by 30 degrees and more to all \
         sides, and show it near and far"
    )]
    Undetermined,
    /// The distortion has no inverse over the whole picture.
    #[error("the distortion follows the noise where no corner was seen{}", list(.empty))]
    Fold {
        /// Regions of the picture without corners.
        empty: Vec<&'static str>,
        /// Place without an inverse.
        source: DistortionError,
    },
}

/// Returns the lens of pictures of `size` that show the board of `views`.
///
/// # Errors
/// If the views are too few, do not determine the lens, or give a distortion without an inverse.
pub fn calibrate_lens(views: &[LensView], size: ImageSize) -> Result<LensCalibration, LensError> {
    let mut used: Vec<LensView> =
        views.iter().filter(|view| view.corners.len() >= MIN_CORNERS).cloned().collect();
    let first = fit_first(&used, size)?;
    let outliers = drop_outliers(&mut used, &first);
    let chosen = choose(&used, size)?;
    let lens = intrinsics(&chosen.fit.bundle.lens);
    let images = used.iter().flat_map(|view| view.corners.iter().map(|corner| corner.image));
    let coverage = Coverage::of(images, size);
    if let Err(source) = lens.check_distortion(size.width, size.height) {
        return Err(LensError::Fold { empty: coverage.empty, source });
    }
    let sd = chosen.fit.sd;
    let rms = rms(&chosen.fit, &corners_of(&used));
    let fits = view_fits(used, &chosen.fit);
    let mut calibration = LensCalibration {
        intrinsics: lens,
        focal_sd: sd[0].max(sd[1]),
        centre_sd: sd[2].max(sd[3]),
        rms,
        held_out: chosen.held_out,
        coverage: coverage.part,
        views: fits,
        outliers,
        findings: Vec::new(),
    };
    calibration.findings = findings(&calibration, &coverage);
    Ok(calibration)
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

fn corners_of(views: &[LensView]) -> Vec<&[SeenCorner]> {
    views.iter().map(|view| &view.corners[..]).collect()
}

/// Fits a lens without k3: first with one coefficient, then with all others.
fn fit_first(views: &[LensView], size: ImageSize) -> Result<Fit, LensError> {
    if views.len() < MIN_VIEWS {
        return Err(LensError::TooFewViews { found: views.len() });
    }
    let corners = corners_of(views);
    let start = start::guess(&corners, size).ok_or(LensError::Undetermined)?;
    let first = minimise(start, &corners, FIRST).ok_or(LensError::Undetermined)?;
    minimise(first.bundle, &corners, WITHOUT_K3).ok_or(LensError::Undetermined)
}

/// Returns the distance of each corner from its image, pixels, view by view.
fn distances(fit: &Fit, views: &[&[SeenCorner]]) -> Vec<Vec<f64>> {
    let lens = intrinsics(&fit.bundle.lens);
    let of_view = |(pose, corners): (&Isometry3<f64>, &&[SeenCorner])| {
        let residuals = residuals(&lens, pose, corners);
        residuals.as_slice().chunks_exact(2).map(|it| it[0].hypot(it[1])).collect()
    };
    fit.bundle.poses.iter().zip(views).map(of_view).collect()
}

/// Returns the root mean square of all distances, pixels.
fn rms(fit: &Fit, views: &[&[SeenCorner]]) -> f64 {
    root_mean_square(distances(fit, views).into_iter().flatten())
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0), |(sum, n), x| (sum + x * x, n + 1));
    (sum / f64::from(n.max(1))).sqrt()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Leaves out the corners that are far from where `fit` puts them, and views that keep too few.
/// Returns the number of corners that were left out.
fn drop_outliers(views: &mut Vec<LensView>, fit: &Fit) -> usize {
    let distances = distances(fit, &corners_of(views));
    let limit = (OUTLIER_MEDIANS * median(distances.iter().flatten().copied().collect()))
        .max(LEAST_OUTLIER);
    let count = |views: &[LensView]| views.iter().map(|view| view.corners.len()).sum::<usize>();
    let before = count(views);
    for (view, distances) in views.iter_mut().zip(distances) {
        let mut distances = distances.into_iter();
        view.corners.retain(|_| distances.next().is_some_and(|distance| distance <= limit));
    }
    views.retain(|view| view.corners.len() >= MIN_CORNERS);
    before - count(views)
}

/// A fit with its error on held-out views, pixels.
struct Candidate {
    fit: Fit,
    held_out: f64,
}

/// Fits the lens with k3 and without. Returns the one without it unless k3 makes the error on
/// held-out views smaller.
fn choose(views: &[LensView], size: ImageSize) -> Result<Candidate, LensError> {
    let corners = corners_of(views);
    let candidate = |fit: Fit, free: usize| {
        let held_out = held_out(&fit, &corners, free)?;
        Some(Candidate { fit, held_out })
    };
    let plain = fit_first(views, size)?;
    let full = minimise(plain.bundle.clone(), &corners, ALL).and_then(|fit| candidate(fit, ALL));
    let plain = candidate(plain, WITHOUT_K3).ok_or(LensError::Undetermined)?;
    let is_better = |full: &Candidate| {
        let lens = intrinsics(&full.fit.bundle.lens);
        full.held_out < (1.0 - K3_GAIN) * plain.held_out
            && lens.check_distortion(size.width, size.height).is_ok()
    };
    Ok(full.filter(is_better).unwrap_or(plain))
}

/// Returns the root mean square of the distances on views that are held out in turn, pixels: the
/// lens is that of the other views, and only the pose is fitted.
fn held_out(fit: &Fit, views: &[&[SeenCorner]], free: usize) -> Option<f64> {
    let mut all = Vec::new();
    for fold in 0..FOLDS {
        let part = |is_held_out: bool| {
            let chosen = (0..views.len()).filter(|n| (n % FOLDS == fold) == is_held_out);
            let chosen: Vec<usize> = chosen.collect();
            let mut bundle = fit.bundle.clone();
            bundle.poses = chosen.iter().map(|&n| fit.bundle.poses[n]).collect();
            (bundle, chosen.iter().map(|&n| views[n]).collect::<Vec<_>>())
        };
        let (others, other_views) = part(false);
        let lens = minimise(others, &other_views, free)?.bundle.lens;
        let (mut held, held_views) = part(true);
        held.lens = lens;
        let held = minimise(held, &held_views, 0)?;
        all.extend(distances(&held, &held_views).into_iter().flatten());
    }
    Some(root_mean_square(all.into_iter()))
}

fn view_fits(views: Vec<LensView>, fit: &Fit) -> Vec<ViewFit> {
    let distances = distances(fit, &corners_of(&views));
    let parts = views.into_iter().zip(&fit.bundle.poses).zip(distances);
    let of_view = |((view, &pose), distances): ((LensView, &Isometry3<f64>), Vec<f64>)| ViewFit {
        name: view.name,
        pose,
        rms: root_mean_square(distances.into_iter()),
        corners: view.corners,
    };
    parts.map(of_view).collect()
}

/// Says what was seen and what to do next.
fn findings(calibration: &LensCalibration, coverage: &Coverage) -> Vec<String> {
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
fn list(empty: &[&'static str]) -> String {
    if empty.is_empty() { String::new() } else { format!(", none at the {}", empty.join(", ")) }
}
