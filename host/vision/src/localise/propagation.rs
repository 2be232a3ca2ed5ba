//! Propagation of a circle's covariance to the rig frame.

use nalgebra::{Matrix3, Point3};

use crate::camera::{Camera, Intrinsics};
use crate::observation::{Circle, Gaussian3};

/// Returns the derivatives of the centre's x and y (rows) at depth `z`, metres, by the circle's
/// column and row; the other elements are 0. `None` where the distortion of the lens folds.
pub(super) fn across(circle: &Circle, z: f64, intrinsics: &Intrinsics) -> Option<Matrix3<f64>> {
    let mut derivatives = Matrix3::zeros();
    let plane = intrinsics.deproject_derivatives(circle.u, circle.v, z)?;
    derivatives.fixed_view_mut::<2, 2>(0, 0).copy_from(&plane);
    Some(derivatives)
}

/// Returns the distribution in the rig frame of a point in camera axes with the covariance
/// `in_camera`, metres².
pub(super) fn in_rig_frame(
    camera: &Camera,
    point: &Point3<f64>,
    in_camera: &Matrix3<f64>,
) -> Gaussian3 {
    let rotation = camera.pose.rotation.to_rotation_matrix();
    let covariance = rotation * in_camera * rotation.transpose();
    Gaussian3 { mean: camera.pose * point, covariance }
}
