//! Pose from known places of the ball.
//!
//! The ball is put to at least four places whose coordinates are measured in the rig frame, and
//! seen at each. The pose is the rigid transformation with the least squares of the differences,
//! weighted with the covariances of both; a start from all triples of places, with a bounded loss,
//! keeps wrong places out.

use nalgebra::{DVector, Isometry3, Matrix3, Point3, Translation3};
use plumb_frame::observation::Gaussian3;

use crate::calibration::{Calibration, CalibrationError, Sample};
use crate::least_squares::{Minimum, minimise};
use crate::rigid::{self, Handedness, Orthogonal};

/// Least number of places.
pub const MIN_PLACES: usize = 4;
/// Greatest number of places: the start tries every triple of them.
pub const MAX_PLACES: usize = 40;
/// Usual standard deviation of a place measured with a rule, each axis, metres.
pub const PLACE_SD_M: f64 = 0.003;

/// Least root mean square distance of the places from a line, metres.
const MIN_OFF_LINE_M: f64 = 0.04;
/// Least root mean square distance of the places from a plane, metres.
const MIN_OFF_PLANE_M: f64 = 0.02;
/// The same in standard deviations of a place.
const MIN_OFF_PLANE_SD: f64 = 4.0;
/// A place whose squared Mahalanobis distance is above this is an outlier: 1 of 1000 of three
/// normal residuals is.
const OUTLIER: f64 = 16.3;
/// A mirrored frame fits better if its cost is below this share.
const MIRRORED_SHARE: f64 = 0.5;
/// Least difference of the two scales that is reported, as a share of 1.
const SCALE_TOLERANCE: f64 = 0.02;

/// A place of the ball, known in the rig frame and seen by the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallPlace {
    /// The ball's centre in the rig frame as measured, metres.
    pub known: Point3<f64>,
    /// Standard deviation of that measurement along each axis, metres, above 0.
    pub known_sd: f64,
    /// The ball's centre as the camera sees it, camera axes, metres.
    pub seen: Gaussian3,
}

impl BallPlace {
    /// Returns the covariance of the difference between both, metres², for a pose.
    fn covariance(&self, pose: &Isometry3<f64>) -> Matrix3<f64> {
        let rotation = pose.rotation.to_rotation_matrix();
        let known = Matrix3::identity() * self.known_sd.powi(2);
        rotation * self.seen.covariance * rotation.transpose() + known
    }

    /// Returns the squared Mahalanobis distance between the known place and `image`, the seen one
    /// in the rig frame.
    fn distance2(&self, pose: &Isometry3<f64>, image: &Point3<f64>) -> f64 {
        let difference = image - self.known;
        let inverse = self.covariance(pose).try_inverse().unwrap_or_default();
        (difference.transpose() * inverse * difference).x
    }

    fn pair(&self) -> (Point3<f64>, Point3<f64>) {
        (self.seen.mean, self.known)
    }

    /// Returns the distance between the two with a pose, metres.
    fn residual(&self, pose: &Isometry3<f64>) -> f64 {
        (pose * self.seen.mean - self.known).norm()
    }
}

/// Mean of several observations of a ball at rest.
///
/// The covariance is that of one observation, which does not get smaller with the number of frames:
/// most of a depth camera's error is the same in every frame. `None` of no observations.
pub fn mean_of(observations: &[Gaussian3]) -> Option<Gaussian3> {
    let n = observations.len() as f64;
    // The median along each axis ignores single frames with a wrong depth.
    let median = |axis: usize| -> Option<f64> {
        let mut values: Vec<f64> = observations.iter().map(|it| it.mean[axis]).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let mean = Point3::new(median(0)?, median(1)?, median(2)?);
    let covariance = observations.iter().map(|it| it.covariance).sum::<Matrix3<f64>>() / n;
    Some(Gaussian3 { mean, covariance })
}

/// Returns the camera's pose from places of the ball.
///
/// # Errors
/// If the places are too few, on a line, in a plane, mirrored, or contradict each other.
pub fn pose_from_places(places: &[BallPlace]) -> Result<Calibration, CalibrationError> {
    check(places)?;
    let all: Vec<&BallPlace> = places.iter().collect();
    let start = robust_start(&all, Handedness::Kept).ok_or(CalibrationError::Undetermined)?;
    let mirrored = robust_start(&all, Handedness::Mirrored);
    if mirrored.is_some_and(|mirrored| mirrored.cost < MIRRORED_SHARE * start.cost)
        && start.cost >= OUTLIER
    {
        return Err(CalibrationError::Mirrored);
    }
    let mut pose = start.map.isometry();
    let mut minimum = None;
    let mut used = Vec::new();
    for _ in 0..3 {
        used = all.iter().copied().filter(|it| is_consistent(it, &pose)).collect();
        check_agreement(places, &used)?;
        let found = refined(&used, &pose).ok_or(CalibrationError::Undetermined)?;
        pose = found.pose;
        minimum = Some(found);
    }
    let minimum = minimum.ok_or(CalibrationError::Undetermined)?;
    let samples = samples(places, &used, &pose);
    let findings = findings(&used);
    Ok(Calibration {
        pose,
        position_sd: minimum.position_sd(),
        rotation_sd: minimum.rotation_sd(),
        samples,
        findings,
    })
}

/// Checks that the known places determine a pose.
fn check(places: &[BallPlace]) -> Result<(), CalibrationError> {
    if places.len() < MIN_PLACES {
        let what = "places of the ball";
        return Err(CalibrationError::TooFew { what, found: places.len(), needed: MIN_PLACES });
    }
    let known: Vec<_> = places.iter().map(|place| place.known).collect();
    let [_, off_line, off_plane] = rigid::spread(&known);
    if off_line < MIN_OFF_LINE_M {
        let what = "the places of the ball";
        let advice = "Move at least one of them";
        return Err(CalibrationError::OnALine { what, advice, off: off_line, needed: 0.1 });
    }
    let sd = places.iter().map(|place| place.known_sd).fold(0.0, f64::max);
    if off_plane < MIN_OFF_PLANE_M.max(MIN_OFF_PLANE_SD * sd) {
        return Err(CalibrationError::InAPlane { off: off_plane, needed: 0.1 });
    }
    Ok(())
}

/// Checks that the used places are most of all, and still determine a pose.
fn check_agreement(places: &[BallPlace], used: &[&BallPlace]) -> Result<(), CalibrationError> {
    let is_most = used.len() >= MIN_PLACES && 3 * used.len() >= 2 * places.len();
    let known: Vec<_> = used.iter().map(|place| place.known).collect();
    if is_most && rigid::spread(&known)[2] >= MIN_OFF_PLANE_M {
        return Ok(());
    }
    // Which place is wrong is not certain: the residuals of all are reported.
    let pairs: Vec<_> = places.iter().map(BallPlace::pair).collect();
    let pose = rigid::fit(&pairs, Handedness::Kept).ok_or(CalibrationError::Undetermined)?;
    let pose = pose.isometry();
    let residual = |(i, place): (usize, &BallPlace)| (name(i), place.residual(&pose));
    let residuals = places.iter().enumerate().map(residual).collect();
    Err(CalibrationError::Inconsistent { residuals })
}

fn is_consistent(place: &BallPlace, pose: &Isometry3<f64>) -> bool {
    place.distance2(pose, &(pose * place.seen.mean)) <= OUTLIER
}

fn name(index: usize) -> String {
    format!("place {}", index + 1)
}

/// Transformation from three places, and its cost over all.
struct Start {
    map: Orthogonal,
    cost: f64,
}

/// Returns the transformation with the least cost among those of all triples and of all places. The
/// cost of a place is bounded, so that wrong places do not decide.
fn robust_start(places: &[&BallPlace], handedness: Handedness) -> Option<Start> {
    let n = places.len().min(MAX_PLACES);
    let pairs_above = move |a: usize| (a + 1..n).flat_map(move |b| (b + 1..n).map(move |c| [b, c]));
    let triples = (0..n).flat_map(move |a| pairs_above(a).map(move |[b, c]| [a, b, c]));
    let pairs: Vec<_> = places.iter().map(|place| place.pair()).collect();
    let subsets = triples.map(|triple| triple.map(|i| pairs[i]).to_vec());
    subsets
        .chain([pairs.clone()])
        .filter_map(|subset| rigid::fit(&subset, handedness))
        .map(|map| Start { cost: bounded_cost(places, &map), map })
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
}

fn bounded_cost(places: &[&BallPlace], map: &Orthogonal) -> f64 {
    let cost = |place: &&BallPlace| {
        // The covariance of the seen place is turned with the pose; of a mirrored frame its trace
        // is enough.
        let sd2 = place.known_sd.powi(2) + place.seen.covariance.trace() / 3.0;
        ((map.apply(&place.seen.mean) - place.known).norm_squared() / sd2).min(OUTLIER)
    };
    places.iter().map(cost).sum()
}

/// Returns the pose with the least weighted squares near `start`.
fn refined(places: &[&BallPlace], start: &Isometry3<f64>) -> Option<Minimum> {
    // The position is that of the places' centroid, so that its error is apart from the rotation's.
    let centre = rigid::centroid(places.iter().map(|place| place.seen.mean));
    let to_centre = Translation3::from(centre);
    let whitening: Vec<Matrix3<f64>> = places
        .iter()
        .map(|place| place.covariance(start).try_inverse()?.cholesky().map(|it| it.l().transpose()))
        .collect::<Option<_>>()?;
    let mut minimum = minimise(start * to_centre, |pose| {
        let residuals = places.iter().zip(&whitening).map(|(place, whitening)| {
            whitening * (pose * (place.seen.mean - centre.coords) - place.known)
        });
        DVector::from_iterator(3 * places.len(), residuals.flat_map(|r| [r.x, r.y, r.z]))
    })?;
    minimum.pose *= to_centre.inverse();
    Some(minimum)
}

/// Returns all places with their residuals, those of the used ones also held out.
fn samples(places: &[BallPlace], used: &[&BallPlace], pose: &Isometry3<f64>) -> Vec<Sample> {
    let held_out = |place: &BallPlace| -> Option<f64> {
        let others: Vec<_> = used.iter().copied().filter(|it| !std::ptr::eq(*it, place)).collect();
        let known: Vec<_> = others.iter().map(|place| place.known).collect();
        let determines = others.len() >= 3 && rigid::spread(&known)[1] >= MIN_OFF_LINE_M / 2.0;
        let minimum = refined(&others, pose).filter(|_| determines)?;
        Some(place.residual(&minimum.pose))
    };
    let sample = |(i, place): (usize, &BallPlace)| {
        let is_outlier = !used.iter().any(|it| std::ptr::eq(*it, place));
        Sample {
            name: name(i),
            known: place.known,
            seen: place.seen.mean,
            residual: place.residual(pose),
            held_out: if is_outlier { None } else { held_out(place) },
            is_outlier,
        }
    };
    places.iter().enumerate().map(sample).collect()
}

/// Compares the size of the known set of places with that of the seen one.
fn findings(used: &[&BallPlace]) -> Vec<String> {
    let size = |point: fn(&BallPlace) -> Point3<f64>| -> f64 {
        let points: Vec<_> = used.iter().map(|place| point(place)).collect();
        rigid::spread(&points).iter().map(|sd| sd * sd).sum::<f64>().sqrt()
    };
    let (known, seen) = (size(|place| place.known), size(|place| place.seen.mean));
    let scale = seen / known;
    if (scale - 1.0).abs() <= SCALE_TOLERANCE {
        return Vec::new();
    }
    vec![format!(
        "the camera sees the places {:.1} % {} apart than they were measured: check the unit of \
         the places (metres), intrinsics.depth_scale and the focal length in the camera file",
        (scale - 1.0).abs() * 100.0,
        if scale > 1.0 { "farther" } else { "less" },
    )]
}
