//! Fit of a sphere of the ball's radius to the depth of coloured pixels.

use std::f64::consts::{PI, TAU};

use nalgebra::Point3;

use super::super::robust_fit::TukeyStep;
use super::super::view::{Disc, FrameView};

/// Weight of the previous centre against few pixels, in pixels.
const DAMPING: f64 = 1e-3;

/// A sphere of the ball's radius in the depth image.
pub(super) struct Sphere {
    /// Camera axes, metres.
    pub(super) centre: Point3<f64>,
    /// Part of the ball's disc that is on the sphere, 0 to 1.
    pub(super) filled: f64,
}

/// Returns the centre (camera axes, metres) of the sphere about a blob whose surface has depth `z`,
/// metres; `None` if there is no such sphere.
pub(in super::super) fn sphere_at(view: &FrameView, disc: &Disc, z: f64) -> Option<Point3<f64>> {
    let Sphere { centre, filled } = fit_sphere(view, disc.u, disc.v, z)?;
    (filled * ends(view, &centre) > view.parameters.sphere.min_quality).then_some(centre)
}

/// Returns the part of the directions in which, beyond the end of a ball at `centre`, nothing is as
/// near as the ball.
pub(super) fn ends(view: &FrameView, centre: &Point3<f64>) -> f64 {
    let Some(disc) = view.disc_of(centre) else { return 0.0 };
    let parameters = &view.parameters.sphere;
    let reach = view.parameters.clusters.beyond.at(disc.radius);
    let in_front = centre.z - parameters.in_front * view.ball_radius;
    let count = parameters.end_directions;
    let ends = (0..count).filter(|&i| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(count)).sin_cos();
        let beside = view.depth.at(disc.u + reach * cos, disc.v + reach * sin);
        beside.is_none_or(|z| z > centre.z || z < in_front)
    });
    ends.count() as f64 / f64::from(count)
}

/// Fits a sphere of the ball's radius to the coloured depth around a pixel with depth `z`, metres.
pub(super) fn fit_sphere(view: &FrameView, u: f64, v: f64, z: f64) -> Option<Sphere> {
    let (ball, parameters) = (view.ball_radius, &view.parameters.sphere);
    let radius = view.radius_at(z + ball);
    let mut centre = view.intrinsics().deproject(u, v, z + parameters.first_depth * ball);
    let mut points = read_points(view, &centre, radius);
    let mut on_sphere = 0.0;
    for (step, cutoff) in parameters.cutoffs.iter().enumerate() {
        if step == parameters.reread_step {
            points = read_points(view, &centre, radius);
        }
        let mut fit = TukeyStep::new(cutoff * ball, DAMPING);
        for point in &points {
            let outwards = point - centre;
            let distance = outwards.norm();
            // The far side of the ball is not visible.
            if distance > 1e-9 && outwards.dot(&centre.coords) <= 0.0 {
                fit.add(outwards / distance, distance - ball, 1.0);
            }
        }
        if fit.inliers() < parameters.min_pixels {
            return None;
        }
        on_sphere = fit.weights();
        let moved = fit.solve()?.step;
        centre += moved * (parameters.max_move * ball / moved.norm()).min(1.0);
    }
    let step = (2.0 * radius / parameters.grid).max(1.0);
    let filled = (on_sphere / (PI * (radius / step).powi(2))).min(1.0);
    (centre.z > 2.0 * ball).then_some(Sphere { centre, filled })
}

/// Returns the coloured pixels with depth around the image of `centre`, as points in camera axes.
fn read_points(view: &FrameView, centre: &Point3<f64>, radius: f64) -> Vec<Point3<f64>> {
    let parameters = &view.parameters.sphere;
    let Some((u, v)) = view.intrinsics().project(centre) else { return Vec::new() };
    let (step, limit) = ((2.0 * radius / parameters.grid).max(1.0), parameters.reach * radius);
    let reach = (limit / step).ceil() as i32;
    let mut points = Vec::new();
    for j in -reach..=reach {
        for i in -reach..=reach {
            let [x, y] = [u + f64::from(i) * step, v + f64::from(j) * step]
                .map(|k| f64::from((k + 0.5) as i32));
            if (x - u).powi(2) + (y - v).powi(2) > limit.powi(2) {
                continue;
            }
            let Some(z) = view.depth.at(x, y) else { continue };
            if (z - centre.z).abs() < parameters.depth_reach * view.ball_radius
                && view.colour.likeness(x, y) >= view.parameters.clusters.min_likeness
            {
                points.push(view.intrinsics().deproject(x, y, z));
            }
        }
    }
    points
}
