//! Position of a ball that moves in the plane x = 0 of the rig frame.

use nalgebra::{Matrix3, Vector3};

use super::propagation::across;
use crate::camera::{Camera, Intrinsics};
use crate::observation::{Circle, Gaussian3};

/// Returns where the ray of the ball's centre meets the plane x = 0 of the rig frame, for a camera
/// without depth, with `intrinsics`. Returns `None` if it does not meet the plane in front of the
/// camera, or is where the distortion of the lens folds.
///
/// With the camera at o and the ray's direction d, both in the rig frame, the place is
/// o - d o_x / d_x. The covariance is that of column and row. That along x, of which nothing is
/// measured, is the larger one in the plane.
pub fn localise_on_plane(
    circle: &Circle,
    intrinsics: &Intrinsics,
    camera: &Camera,
) -> Option<Gaussian3> {
    let origin = camera.pose.translation.vector;
    let rotation = camera.pose.rotation.to_rotation_matrix();
    let direction = rotation * intrinsics.deproject(circle.u, circle.v, 1.0).coords;
    let depth = -origin.x / direction.x;
    if !(depth.is_finite() && depth > 0.0) {
        return None;
    }
    let mut place = origin + direction * depth;
    place.x = 0.0;
    // A change of the ray at this depth, brought back to the plane along the ray.
    let along =
        Matrix3::from_columns(&[direction / direction.x, Vector3::zeros(), Vector3::zeros()]);
    let to_plane = (Matrix3::identity() - along) * rotation;
    let derivatives = to_plane * across(circle, depth, intrinsics)?;
    let mut covariance = derivatives * circle.covariance * derivatives.transpose();
    covariance[(0, 0)] = covariance[(1, 1)].max(covariance[(2, 2)]);
    Some(Gaussian3 { mean: place.into(), covariance })
}
