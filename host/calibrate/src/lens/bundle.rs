//! Least squares over the parameters of a lens and the pose of the board in each view
//! (Levenberg-Marquardt).

use nalgebra::{DMatrix, DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use plumb_frame::camera::{Distortion, DistortionCoefficients, Intrinsics};

use crate::board_pose::SeenCorner;

/// Parameters of a lens: fx, fy, cx, cy, k1, k2, p1, p2, k3.
pub(super) const ALL: usize = 9;
/// The same without k3.
pub(super) const WITHOUT_K3: usize = 8;
/// Focal lengths, principal point and k1.
pub(super) const FIRST: usize = 5;
/// Parameters of a pose: a rotation and a shift.
const POSE: usize = 6;
/// Steps of the numerical derivatives: pixels and coefficients of the lens, then radians and
/// metres of a pose.
const STEPS: [f64; ALL + POSE] =
    [1e-3, 1e-3, 1e-3, 1e-3, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6];
/// Residual of a corner that the lens does not see, pixels.
const UNSEEN: f64 = 1e3;
/// Iterations after which the search ends.
const MAX_ITERATIONS: usize = 60;
/// Relative decrease of the cost that ends the search.
const LAST_DECREASE: f64 = 1e-9;
/// Damping at the start, and the largest one that is tried.
const DAMPING: [f64; 2] = [1e-3, 1e10];

/// Corners of one view.
pub(super) type Corners = [SeenCorner];

/// A lens, and the poses of the board in camera axes.
#[derive(Debug, Clone)]
pub(super) struct Bundle {
    pub(super) lens: [f64; ALL],
    pub(super) poses: Vec<Isometry3<f64>>,
}

/// Minimum of the squared residuals.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) bundle: Bundle,
    /// Standard deviations of the lens's parameters, for residuals of their own size; 0 of one that
    /// was not free.
    pub(super) sd: [f64; ALL],
}

/// Returns the intrinsics of the parameters, without depth.
pub(super) fn intrinsics(&[fx, fy, cx, cy, k1, k2, p1, p2, k3]: &[f64; ALL]) -> Intrinsics {
    let distortion = Distortion::new(DistortionCoefficients { k1, k2, p1, p2, k3 });
    Intrinsics { fx, fy, cx, cy, depth_scale: 0.0, distortion }
}

/// Returns the distances of the corners from their images: columns and rows in turn, pixels.
pub(super) fn residuals(
    intrinsics: &Intrinsics,
    pose: &Isometry3<f64>,
    corners: &Corners,
) -> DVector<f64> {
    let residual = |corner: &SeenCorner| {
        let point = pose * Point3::new(corner.board.x, corner.board.y, 0.0);
        match intrinsics.project(&point) {
            Some((u, v)) => [u - corner.image.x, v - corner.image.y],
            None => [UNSEEN; 2],
        }
    };
    DVector::from_iterator(2 * corners.len(), corners.iter().flat_map(residual))
}

/// Returns the bundle with the least squares near `start`. The first `free` parameters of the lens
/// and all poses are free. Returns `None` if the views do not determine them.
pub(super) fn minimise(start: Bundle, views: &[&Corners], free: usize) -> Option<Fit> {
    let mut bundle = start;
    let mut cost = cost(&bundle, views);
    let [mut damping, most] = DAMPING;
    for _ in 0..MAX_ITERATIONS {
        let Equations { normal, gradient } = equations(&bundle, views, free);
        let before = cost;
        loop {
            let mut damped = normal.clone();
            damped.set_diagonal(&(normal.diagonal() * (1.0 + damping)));
            let step = damped.cholesky()?.solve(&-&gradient);
            let next = moved(&bundle, &step, free);
            let next_cost = self::cost(&next, views);
            if next_cost < cost {
                (bundle, cost, damping) = (next, next_cost, damping / 10.0);
                break;
            }
            damping *= 10.0;
            if damping > most {
                break;
            }
        }
        if before - cost <= LAST_DECREASE * before {
            break;
        }
    }
    let sd = standard_deviations(&bundle, views, free, cost)?;
    cost.is_finite().then_some(Fit { bundle, sd })
}

/// Returns the sum of the squared residuals, pixels².
fn cost(bundle: &Bundle, views: &[&Corners]) -> f64 {
    let lens = intrinsics(&bundle.lens);
    let pairs = bundle.poses.iter().zip(views);
    pairs.map(|(pose, corners)| residuals(&lens, pose, corners).norm_squared()).sum()
}

/// Normal equations of the least squares.
struct Equations {
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// Returns the normal equations at `bundle`, with derivatives by central differences.
fn equations(bundle: &Bundle, views: &[&Corners], free: usize) -> Equations {
    let lens = intrinsics(&bundle.lens);
    let shifted = |k: usize, step: f64| {
        let mut lens = bundle.lens;
        lens[k] += step;
        intrinsics(&lens)
    };
    let lenses: Vec<_> = (0..free).map(|k| [shifted(k, STEPS[k]), shifted(k, -STEPS[k])]).collect();
    let size = free + POSE * views.len();
    let (mut normal, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
    for (n, (pose, corners)) in bundle.poses.iter().zip(views).enumerate() {
        let mut jacobian = DMatrix::zeros(2 * corners.len(), free + POSE);
        for (k, [plus, minus]) in lenses.iter().enumerate() {
            let change = residuals(plus, pose, corners) - residuals(minus, pose, corners);
            jacobian.set_column(k, &(change / (2.0 * STEPS[k])));
        }
        for k in 0..POSE {
            let step = STEPS[ALL + k];
            let at = |step: f64| residuals(&lens, &moved_pose(pose, k, step), corners);
            jacobian.set_column(free + k, &((at(step) - at(-step)) / (2.0 * step)));
        }
        let products = jacobian.tr_mul(&jacobian);
        let slopes = jacobian.tr_mul(&residuals(&lens, pose, corners));
        let place = |k: usize| if k < free { k } else { k + POSE * n };
        for row in 0..free + POSE {
            gradient[place(row)] += slopes[row];
            for column in 0..free + POSE {
                normal[(place(row), place(column))] += products[(row, column)];
            }
        }
    }
    Equations { normal, gradient }
}

/// Returns `bundle` after a step: the lens's free parameters, then the poses.
fn moved(bundle: &Bundle, step: &DVector<f64>, free: usize) -> Bundle {
    let mut lens = bundle.lens;
    for (k, parameter) in lens.iter_mut().enumerate().take(free) {
        *parameter += step[k];
    }
    let pose = |(n, pose): (usize, &Isometry3<f64>)| {
        let part = |k: usize| step[free + POSE * n + k];
        turned(pose, Vector3::new(part(0), part(1), part(2)), [part(3), part(4), part(5)].into())
    };
    Bundle { lens, poses: bundle.poses.iter().enumerate().map(pose).collect() }
}

/// Returns a pose of which one parameter changed by `step`.
fn moved_pose(pose: &Isometry3<f64>, parameter: usize, step: f64) -> Isometry3<f64> {
    let mut change = [0.0; POSE];
    change[parameter] = step;
    let [x, y, z, shift @ ..] = change;
    turned(pose, Vector3::new(x, y, z), shift.into())
}

/// Returns a pose after a small rotation (about the board's origin) and a shift.
fn turned(pose: &Isometry3<f64>, turn: Vector3<f64>, shift: Vector3<f64>) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_scaled_axis(turn) * pose.rotation;
    Isometry3::from_parts(Translation3::from(pose.translation.vector + shift), rotation)
}

/// Returns the standard deviations of the lens's free parameters.
fn standard_deviations(
    bundle: &Bundle,
    views: &[&Corners],
    free: usize,
    cost: f64,
) -> Option<[f64; ALL]> {
    let Equations { normal, .. } = equations(bundle, views, free);
    let count = 2 * views.iter().map(|corners| corners.len()).sum::<usize>();
    let variance = cost / count.saturating_sub(normal.nrows()).max(1) as f64;
    let covariance = normal.cholesky()?.inverse() * variance;
    Some(std::array::from_fn(|k| if k < free { covariance[(k, k)].sqrt() } else { 0.0 }))
}
