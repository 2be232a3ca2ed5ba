//! Intrinsics and distortion of a lens from views of the printed board.
//!
//! The corners of the board in all views determine the lens and the pose of the board in each view:
//! the least squares of the distances in the pictures (Zhang's method). The coefficient k3 is free
//! only where it makes the error on held-out views smaller: a polynomial of a high order follows
//! the noise where no corner was seen.

mod bundle;
mod coverage;
mod result;
mod start;

use nalgebra::Isometry3;
use plumb_frame::camera::DistortionError;
use plumb_frame::image::ImageSize;
use thiserror::Error;

use crate::board_pose::{MIN_CORNERS, SeenCorner};
use bundle::{ALL, FIRST, Fit, WITHOUT_K3, intrinsics, minimise, residuals};
use coverage::Coverage;
use result::{findings, list};

pub use result::{LensCalibration, ViewFit};

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
/// The board in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct LensView {
    /// Name of the picture for a person.
    pub name: String,
    /// Corners of the board, pixels.
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
