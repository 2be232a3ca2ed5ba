//! Pose from a printed board whose place in the rig is known, and the average of several views of a
//! board at rest.
//!
//! The pose minimises the distances of the board's corners from their images, and those of their
//! depths where there is depth. The images give direction and, through the size of the squares, the
//! distance; depth decides between the two poses that a small plane may have, and improves its
//! tilt. The ratio of the depth camera's scale to that of the squares is estimated too, so that a
//! wrong scale does not tilt the board.

use nalgebra::{
    DVector, Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector2, Vector3,
};
use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::RgbdFrame;

use crate::board::{CharucoSheet, Placement};
use crate::calibration::{Calibration, CalibrationError, Sample};
use crate::corners::BoardCorner;
use crate::depth::{depth_near, depth_sd};
use crate::homography;
use crate::least_squares::{Minimum, minimise};

/// Least number of corners.
pub(crate) const MIN_CORNERS: usize = 8;
/// Standard deviation of a corner's mean, pixels: the systematic part of the refinement's error.
const CORNER_SD: f64 = 0.12;
/// Prior standard deviation of the ratio of the two scales, from the errors of depth cameras.
const SCALE_SD: f64 = 0.02;
/// Ratio of the two scales that is reported.
const SCALE_TOLERANCE: f64 = 0.02;
/// Least difference of cost (χ²) between the two poses of a plane.
const MIN_COST_DIFFERENCE: f64 = 12.0;
/// Angle within which two poses are the same, radians.
const SAME_POSE: f64 = 0.02;
/// A corner whose residual is above so many standard deviations is an outlier.
const OUTLIER_SD: f64 = 6.0;
/// Number of groups of corners that are held out in turn.
const FOLDS: usize = 6;

/// Returns the camera's pose from the corners of a board.
///
/// # Errors
/// If the corners are too few, or two poses explain them about equally well.
pub fn pose_from_board(
    corners: &[SeenCorner],
    intrinsics: &Intrinsics,
    placement: &Placement,
) -> Result<Calibration, CalibrationError> {
    let problem = Problem { intrinsics };
    let mut used: Vec<&SeenCorner> = corners.iter().collect();
    let mut best = problem.solve(&used)?;
    let kept: Vec<_> =
        used.iter().copied().filter(|it| !problem.is_outlier(it, &best.pose)).collect();
    if kept.len() < used.len() {
        used = kept;
        best = problem.solve(&used)?;
    }
    let board_to_camera = best.pose;
    let board_to_rig = placement.pose();
    let held_out = problem.held_out(&used, &board_to_camera);
    let sample = |corner: &SeenCorner| {
        let place = used.iter().position(|it| it.id == corner.id);
        Sample {
            name: format!("corner {}", corner.id),
            known: board_to_rig * on_board(corner),
            seen: problem.seen(corner, &board_to_camera),
            residual: problem.distance(corner, &board_to_camera),
            held_out: place.and_then(|k| held_out[k]),
            is_outlier: place.is_none(),
        }
    };
    Ok(Calibration {
        pose: board_to_rig * board_to_camera.inverse(),
        position_sd: best.position_sd(),
        rotation_sd: best.rotation_sd(),
        samples: corners.iter().map(sample).collect(),
        findings: problem.findings(&used, &board_to_camera),
    })
}

fn on_board(corner: &SeenCorner) -> Point3<f64> {
    Point3::new(corner.board.x, corner.board.y, 0.0)
}

/// Estimation of the board's pose in camera axes.
struct Problem<'a> {
    intrinsics: &'a Intrinsics,
}

impl Problem<'_> {
    /// Returns the better of the two poses of a plane.
    fn solve(&self, corners: &[&SeenCorner]) -> Result<Minimum, CalibrationError> {
        let found = corners.len();
        if found < MIN_CORNERS {
            let what = "corners of the board";
            return Err(CalibrationError::TooFew { what, found, needed: MIN_CORNERS });
        }
        let start = self.start(corners).ok_or(CalibrationError::Undetermined)?;
        let first = self.refined(corners, &start);
        let second = first.as_ref().and_then(|it| self.refined(corners, &turned(&it.pose)));
        let first = first.ok_or(CalibrationError::Undetermined)?;
        let Some(second) = second else { return Ok(first) };
        let is_same = first.pose.rotation.angle_to(&second.pose.rotation) < SAME_POSE;
        let (best, other) =
            if second.cost < first.cost { (second, first) } else { (first, second) };
        if !is_same && other.cost - best.cost < MIN_COST_DIFFERENCE {
            return Err(CalibrationError::Ambiguous);
        }
        Ok(best)
    }

    /// Returns the pose of the homography between board and image (Zhang's method).
    fn start(&self, corners: &[&SeenCorner]) -> Option<Isometry3<f64>> {
        let normalised = |p: &Point2<f64>| self.intrinsics.deproject(p.x, p.y, 1.0).xy();
        let pairs: Vec<_> = corners.iter().map(|it| (it.board, normalised(&it.image))).collect();
        Some(homography::pose(&homography::fit(&pairs)?))
    }

    /// Returns the pose with the least squares near `start`.
    fn refined(&self, corners: &[&SeenCorner], start: &Isometry3<f64>) -> Option<Minimum> {
        // The position is that of the corners' centroid, so that its error is apart from the
        // rotation's.
        let centre = corners.iter().map(|it| on_board(it).coords).sum::<Vector3<f64>>()
            / corners.len() as f64;
        let to_centre = Translation3::from(centre);
        let mut minimum = minimise(start * to_centre, |pose| {
            self.residuals(corners, &(pose * to_centre.inverse()))
        })?;
        minimum.pose *= to_centre.inverse();
        (minimum.pose * Point3::from(centre)).z.is_sign_positive().then_some(minimum)
    }

    /// Returns the residuals in standard deviations: columns, rows, depths and the scale.
    fn residuals(&self, corners: &[&SeenCorner], pose: &Isometry3<f64>) -> DVector<f64> {
        let scale = depth_scale(corners, pose);
        let mut residuals = Vec::with_capacity(3 * corners.len() + 1);
        for corner in corners {
            let p = pose * on_board(corner);
            // A point behind the camera is far from every pixel.
            let (u, v) = self.intrinsics.project(&p).unwrap_or((1e6, 1e6));
            residuals.push((u - corner.image.x) / CORNER_SD);
            residuals.push((v - corner.image.y) / CORNER_SD);
            let depth = corner.depth.map(|z| (scale * p.z - z) / depth_sd(z));
            residuals.push(depth.unwrap_or(0.0));
        }
        residuals.push((scale - 1.0) / SCALE_SD);
        DVector::from_vec(residuals)
    }

    /// Returns the distance of a corner's image from where `pose` puts it, pixels.
    fn pixels(&self, corner: &SeenCorner, pose: &Isometry3<f64>) -> f64 {
        let image = self.intrinsics.project(&(pose * on_board(corner)));
        image.map_or(f64::INFINITY, |(u, v)| (Point2::new(u, v) - corner.image).norm())
    }

    /// Returns the same distance at the corner, metres.
    fn distance(&self, corner: &SeenCorner, pose: &Isometry3<f64>) -> f64 {
        let metres_per_pixel = (pose * on_board(corner)).z / self.intrinsics.fx;
        self.pixels(corner, pose) * metres_per_pixel
    }

    /// Returns the point on a corner's ray at the corner's depth.
    fn seen(&self, corner: &SeenCorner, pose: &Isometry3<f64>) -> Point3<f64> {
        let z = (pose * on_board(corner)).z;
        self.intrinsics.deproject(corner.image.x, corner.image.y, z)
    }

    fn is_outlier(&self, corner: &SeenCorner, pose: &Isometry3<f64>) -> bool {
        self.pixels(corner, pose) > OUTLIER_SD * CORNER_SD
    }

    /// Returns each corner's distance from where the corners of the other groups put it, metres.
    fn held_out(&self, corners: &[&SeenCorner], pose: &Isometry3<f64>) -> Vec<Option<f64>> {
        let poses: Vec<Option<Minimum>> = (0..FOLDS)
            .map(|fold| {
                let numbered = corners.iter().copied().enumerate();
                let others: Vec<_> =
                    numbered.filter(|(k, _)| k % FOLDS != fold).map(|it| it.1).collect();
                self.refined(&others, pose)
            })
            .collect();
        let distance = |(k, corner): (usize, &&SeenCorner)| {
            Some(self.distance(corner, &poses[k % FOLDS].as_ref()?.pose))
        };
        corners.iter().enumerate().map(distance).collect()
    }

    /// Compares the depth with the size of the squares.
    fn findings(&self, corners: &[&SeenCorner], pose: &Isometry3<f64>) -> Vec<String> {
        let ratios = corners.iter().filter_map(|it| Some(it.depth? / (pose * on_board(it)).z));
        let mut ratios: Vec<f64> = ratios.collect();
        ratios.sort_by(f64::total_cmp);
        let Some(ratio) = ratios.get(ratios.len() / 2) else {
            return vec!["the board has no depth: its pose comes from the colour alone".to_owned()];
        };
        if (ratio - 1.0).abs() <= SCALE_TOLERANCE {
            return Vec::new();
        }
        vec![format!(
            "depth says that the board is {:.1} % {} than the size of its squares says: measure a \
             square and give it with --square, and check the focal length and \
             intrinsics.depth_scale in the camera file",
            (ratio - 1.0).abs() * 100.0,
            if *ratio > 1.0 { "farther" } else { "nearer" },
        )]
    }
}

/// Returns the ratio of the depths to those of the pose with the least squares, given its prior.
fn depth_scale(corners: &[&SeenCorner], pose: &Isometry3<f64>) -> f64 {
    let (mut numerator, mut denominator) = (SCALE_SD.powi(-2), SCALE_SD.powi(-2));
    for corner in corners {
        if let Some(z) = corner.depth {
            let expected = (pose * on_board(corner)).z;
            let weight = depth_sd(z).powi(-2);
            numerator += weight * expected * z;
            denominator += weight * expected * expected;
        }
    }
    numerator / denominator
}

/// Returns the other pose that a plane with about the same image may have: its normal is reflected
/// at the line of sight (Schweighofer and Pinz, "Robust pose estimation from a planar target").
fn turned(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let sight = pose.translation.vector.normalize();
    let normal = pose * Vector3::z();
    let reflected = 2.0 * sight.dot(&normal) * sight - normal;
    let turn = UnitQuaternion::rotation_between(&normal, &reflected)
        .unwrap_or_else(UnitQuaternion::identity);
    Isometry3::from_parts(pose.translation, turn * pose.rotation)
}

/// Share of the frames in which a corner must be seen.
const MIN_SHARE: f64 = 0.5;
/// Standard deviation of a corner over the frames above which something moved, pixels.
const MAX_SPREAD: f64 = 1.0;
/// Radius of the square from which the depth at a corner is taken, pixels.
const DEPTH_RADIUS: i32 = 2;

/// A corner over several frames of a board at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenCorner {
    /// Number of the corner.
    pub id: usize,
    /// The corner on the board, board axes, metres.
    pub board: Point2<f64>,
    /// Mean of its images, pixels.
    pub image: Point2<f64>,
    /// Median of its depths, metres; `None` where the frames have none.
    pub depth: Option<f64>,
}

/// Corners of one frame with the frame's depths.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BoardView {
    corners: Vec<(BoardCorner, Option<f64>)>,
}

impl BoardView {
    /// Adds the depths of a frame to its corners.
    pub fn new(corners: &[BoardCorner], frame: &RgbdFrame) -> Self {
        let depth = |corner: &BoardCorner| depth_near(frame, &corner.image, DEPTH_RADIUS);
        Self { corners: corners.iter().map(|corner| (*corner, depth(corner))).collect() }
    }
}

/// Averages the corners over frames of a board at rest.
///
/// # Errors
/// If the board moved, or too few corners are seen in most of the frames.
pub fn average(
    views: &[BoardView],
    board: &CharucoSheet,
) -> Result<Vec<SeenCorner>, CalibrationError> {
    let mut seen = Vec::new();
    let mut variance = 0.0;
    for (id, place) in board.corners().into_iter().enumerate() {
        let of_corner = |view: &BoardView| view.corners.iter().find(|it| it.0.id == id).copied();
        let images: Vec<_> = views.iter().filter_map(of_corner).collect();
        let n = images.len() as f64;
        if n < 1.0 || n < MIN_SHARE * views.len() as f64 {
            continue;
        }
        let mean = images.iter().map(|it| it.0.image.coords).sum::<Vector2<f64>>() / n;
        variance +=
            images.iter().map(|it| (it.0.image.coords - mean).norm_squared()).sum::<f64>() / n;
        let mut depths: Vec<f64> = images.iter().filter_map(|it| it.1).collect();
        depths.sort_by(f64::total_cmp);
        let depth = depths.get(depths.len() / 2).copied();
        seen.push(SeenCorner { id, board: place, image: mean.into(), depth });
    }
    if seen.len() < MIN_CORNERS {
        let what = "corners of the board";
        return Err(CalibrationError::TooFew { what, found: seen.len(), needed: MIN_CORNERS });
    }
    let pixels = (variance / seen.len() as f64).sqrt();
    if pixels > MAX_SPREAD {
        return Err(CalibrationError::Moved { what: "the board", pixels });
    }
    Ok(seen)
}
