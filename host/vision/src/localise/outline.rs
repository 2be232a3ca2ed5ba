//! Position of a ball from its outline alone.

use super::propagation::{across, in_rig_frame};
use crate::camera::{Camera, Intrinsics};
use crate::observation::{Circle, Gaussian3};

/// Returns the centre, in the rig frame, of the ball that is seen as `circle` by a camera without
/// depth, with `intrinsics`. Returns `None` if the circle is no circle, or is where the distortion
/// of the lens folds.
///
/// The rays that touch a sphere make a cone. With the direction c = (x, y, 1) to the ball's centre,
/// the radius r of the circle (pixels on the optical axis, focal length f) and the ball's radius R,
/// half the cone's angle θ and the depth z of the centre are
///
/// ```text
/// tan θ = r / (f |c|),   z = R / (|c| sin θ) = R sqrt(1 / |c|² + f² / r²)
/// ```
///
/// The covariance is that of column, row and radius, with their correlations: a ball that is partly
/// covered may be larger and farther to the covered side. A standard deviation σ_r of the radius is
/// one of z² σ_r / (f R) along the ray.
pub fn localise_by_outline(
    circle: &Circle,
    intrinsics: &Intrinsics,
    camera: &Camera,
) -> Option<Gaussian3> {
    let Circle { u, v, radius, covariance } = *circle;
    let is_circle = u.is_finite() && v.is_finite() && radius.is_finite() && radius > 0.0;
    if !is_circle {
        return None;
    }
    let ray = intrinsics.deproject(u, v, 1.0).coords;
    let ball_radius = camera.ball_diameter / 2.0;
    let cotangent = intrinsics.focal() / radius;
    let z = ball_radius * (1.0 / ray.norm_squared() + cotangent * cotangent).sqrt();
    // Derivatives of the position by column, row and radius. The depth hardly depends on the
    // direction: a pixel changes it by less than R / f of what a pixel of the radius does.
    let mut derivatives = across(circle, z, intrinsics)?;
    let depth_by_radius = -(ball_radius * cotangent).powi(2) / (z * radius);
    derivatives.set_column(2, &(ray * depth_by_radius));
    let in_camera = derivatives * covariance * derivatives.transpose();
    Some(in_rig_frame(camera, &(ray * z).into(), &in_camera))
}
