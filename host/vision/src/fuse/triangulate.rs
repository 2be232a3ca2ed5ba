//! Position of a ball from two rays.

use nalgebra::{Matrix3, Point3, Vector3};

use super::view::{Eye, View};
use crate::observation::Gaussian3;

/// Steps of Gauss and Newton: from the middle between the rays two are enough.
const STEPS: usize = 4;

/// Least sine of the angle between two rays that make a point: 1 degree.
const MIN_SINE: f64 = 0.017;

/// A view whose ball has moved since.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray<'a> {
    /// The camera.
    pub(super) eye: &'a Eye,
    /// What it saw.
    pub(super) view: &'a View,
    /// Movement of the ball since, rig frame, metres.
    pub(super) shift: Vector3<f64>,
    /// Covariance of that movement, metres².
    pub(super) shift_covariance: Matrix3<f64>,
}

impl Ray<'_> {
    /// Returns the difference of the view from a ball that is now at `point`, its derivatives by
    /// the point, and its covariance.
    fn residual(&self, point: &Point3<f64>) -> Option<(Vector3<f64>, Matrix3<f64>, Matrix3<f64>)> {
        let projection = self.eye.project(&(point - self.shift))?;
        let derivatives = projection.derivatives;
        let covariance =
            self.view.covariance + derivatives * self.shift_covariance * derivatives.transpose();
        Some((self.view.seen - projection.seen, derivatives, covariance))
    }
}

/// Distance of two rays.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gap {
    /// Point in the middle between the rays, rig frame.
    pub(super) middle: Point3<f64>,
    /// Distance of the second ray from the first one across both, pixels.
    pub(super) pixels: f64,
    /// Variance of `pixels`, pixels².
    pub(super) variance: f64,
    /// Change of `pixels` by a movement of the second ray, pixels per metre, rig frame.
    pub(super) by_movement: Vector3<f64>,
}

/// Returns the gap between two rays; `None` if they are parallel or meet behind a camera.
pub(super) fn gap(rays: &[Ray; 2]) -> Option<Gap> {
    let [from, to] = rays.map(|ray| ray.eye.origin() + ray.shift);
    let [d, e] = rays.map(|ray| ray.eye.direction(ray.view));
    let normal = d.cross(&e);
    let sine = normal.norm();
    if sine.is_nan() || sine < MIN_SINE {
        return None;
    }
    let (baseline, normal) = (to - from, normal / sine);
    let along = baseline.cross(&e).dot(&normal) / sine;
    let along_other = baseline.cross(&d).dot(&normal) / sine;
    if !(along > 0.0 && along_other > 0.0) {
        return None;
    }
    let middle = Point3::from((from + d * along + to + e * along_other) / 2.0);
    let focal = (rays[0].eye.focal + rays[1].eye.focal) / 2.0;
    let scale = focal / (along * along_other).sqrt();
    let mut variance = 0.0;
    for ray in rays {
        let (_, derivatives, covariance) = ray.residual(&middle)?;
        // Pixels along the projected normal, and what they are in metres.
        let across = (derivatives * normal).xy();
        let covariance = covariance.fixed_view::<2, 2>(0, 0);
        variance += across.dot(&(covariance * across)) / across.norm_squared().powi(2);
    }
    let pixels = baseline.dot(&normal) * scale;
    Some(Gap { middle, pixels, variance: variance * scale * scale, by_movement: normal * scale })
}

/// Returns the position that fits two rays best, from `start`: least squares of columns, rows and
/// radii, weighted with their covariances. `None` if the ball would not be in front of a camera.
pub(super) fn triangulate(rays: &[Ray; 2], start: Point3<f64>) -> Option<Gaussian3> {
    let (mut mean, mut covariance) = (start, Matrix3::zeros());
    for _ in 0..STEPS {
        let (mut information, mut pull) = (Matrix3::zeros(), Vector3::zeros());
        for ray in rays {
            let (off, derivatives, noise) = ray.residual(&mean)?;
            let weighted = derivatives.transpose() * noise.try_inverse()?;
            information += weighted * derivatives;
            pull += weighted * off;
        }
        covariance = information.try_inverse()?;
        mean += covariance * pull;
    }
    let covariance = (covariance + covariance.transpose()) / 2.0;
    let is_finite = mean.iter().chain(covariance.iter()).all(|it| it.is_finite());
    is_finite.then_some(Gaussian3 { mean, covariance })
}
