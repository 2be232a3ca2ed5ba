//! Curvature of the surface on a disc, from depth.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::super::disc_depth::places;
use super::super::robust_fit::median;
use super::super::view::{Disc, FrameView};

/// Unknowns of the quadric.
const UNKNOWNS: f64 = 6.0;

/// Curvature of a surface in the direction in which it is the flattest, over that of the ball: 1
/// for the ball, 0 for a plane or a cylinder however inclined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curvature {
    /// Lower bound of the confidence interval.
    pub least: f64,
    /// Upper bound of the confidence interval.
    pub most: f64,
}

/// Unit vectors of the view along the direction to the ball.
struct Axes {
    ahead: Vector3<f64>,
    right: Vector3<f64>,
    down: Vector3<f64>,
}

impl Axes {
    fn new(centre: &Vector3<f64>) -> Self {
        let ahead = centre.normalize();
        let right = (Vector3::x() - ahead * ahead.x).normalize();
        Self { ahead, right, down: ahead.cross(&right) }
    }
}

/// Sums of the least squares of h = a + b x + c y + d x² + e xy + f y².
struct QuadricFit {
    normal: Matrix6<f64>,
    right: Vector6<f64>,
    /// As `right`, for the heights of the ball at the same places.
    ideal: Vector6<f64>,
    squares: f64,
    readings: f64,
}

impl QuadricFit {
    fn add(&mut self, x: f64, y: f64, height: f64, ball: f64) {
        let row = Vector6::new(1.0, x, y, x * x, x * y, y * y);
        self.normal += row * row.transpose();
        self.right += row * height;
        self.ideal += row * ball;
        self.squares += height * height;
        self.readings += 1.0;
    }
}

/// Estimates the curvature of the surface on `disc`, read at `readings` places from the centre to
/// the edge, if a ball there has its centre at depth `z`; `None` if too little of it has depth.
///
/// With x and y across the direction to the ball's centre and h along it, a quadric is fitted to
/// the pixels near the ball's surface. The curvature is the smaller eigenvalue of its Hessian over
/// that of the ball at the same pixels.
pub(super) fn curvature(view: &FrameView, disc: &Disc, z: f64, readings: i32) -> Option<Curvature> {
    let parameters = &view.parameters.curvature;
    let sums = read_surface(view, disc, z, readings);
    if sums.readings < parameters.min_readings {
        return None;
    }
    let inverse = sums.normal.try_inverse()?;
    let (fit, ideal) = (inverse * sums.right, inverse * sums.ideal);
    let variance = (sums.squares - fit.dot(&sums.right)).max(0.0) / (sums.readings - UNKNOWNS);
    // Readings that share a pixel, or a patch of noise, are not independent.
    let places = f64::from((2 * readings + 1) * (2 * readings + 1));
    let area = (2.0 * parameters.surface * disc.radius).powi(2);
    let shared = (parameters.noise_area * places / area).max(1.0);
    let error = (shared * variance * inverse[(3, 3)].max(inverse[(5, 5)])).sqrt();
    if !error.is_finite() {
        return None;
    }
    let (ideal, fit) = (flattest(&ideal).max(parameters.min_ideal), flattest(&fit));
    let margin = parameters.interval * error;
    Some(Curvature { least: (fit - margin) / ideal, most: (fit + margin) / ideal })
}

/// Reads the surface near a ball whose centre has depth `z`, in units of its radius.
fn read_surface(view: &FrameView, disc: &Disc, z: f64, readings: i32) -> QuadricFit {
    let (parameters, ball) = (&view.parameters.curvature, view.ball_radius);
    let intrinsics = view.depth.intrinsics();
    let centre = intrinsics.deproject(disc.u, disc.v, z).coords;
    let Axes { ahead, right, down } = Axes::new(&centre);
    let near = parameters.near_surface + parameters.near_noise * depth_noise(view, z);
    let (normal, zeros) = (Matrix6::zeros(), Vector6::zeros());
    let mut sums = QuadricFit { normal, right: zeros, ideal: zeros, squares: 0.0, readings: 0.0 };
    let part = parameters.surface;
    for i in -readings..=readings {
        for j in -readings..=readings {
            let [x, y] = [i, j].map(|k| f64::from(k) / f64::from(readings) * part);
            let height = 1.0 - x * x - y * y;
            if height < 1.0 - part * part {
                continue;
            }
            let expected = centre + (right * x + down * y - ahead * height.sqrt()) * ball;
            let Some((u, v)) = intrinsics.project(&expected.into()) else { continue };
            let (u, v) = (u.round(), v.round());
            let Some(depth) = view.depth.at(u, v) else { continue };
            let offset = (intrinsics.deproject(u, v, depth).coords - centre) / ball;
            let (x, y, along) = (offset.dot(&right), offset.dot(&down), offset.dot(&ahead));
            let height = 1.0 - x * x - y * y;
            if height > 0.0 && (along + height.sqrt()).abs() <= near {
                sums.add(x, y, along, -height.sqrt());
            }
        }
    }
    sums
}

/// Returns the smaller eigenvalue of half the Hessian of a quadric.
fn flattest(quadric: &Vector6<f64>) -> f64 {
    let (xx, xy, yy) = (quadric[3], quadric[4], quadric[5]);
    (xx + yy) / 2.0 - ((xx - yy) / 2.0).hypot(xy / 2.0)
}

/// Returns the median distance of the depth on `disc` from the sphere of the ball whose centre is
/// at depth `z`, beyond the noise of depth, in the ball's radius. What is farther than a radius
/// from the sphere does not count.
pub(super) fn distance_from_sphere(view: &FrameView, disc: &Disc, z: f64) -> f64 {
    let intrinsics = view.depth.intrinsics();
    let centre = intrinsics.deproject(disc.u, disc.v, z).coords;
    let mut distances = Vec::with_capacity(64);
    for (u, v) in places().map(|place| place.on(disc)) {
        let Some(depth) = view.depth.at(u, v) else { continue };
        let point = intrinsics.deproject(u.round(), v.round(), depth).coords;
        let distance = ((point - centre).norm() / view.ball_radius - 1.0).abs();
        if distance < 1.0 {
            distances.push(distance);
        }
    }
    let median = median(distances).unwrap_or(1.0);
    (median.powi(2) - depth_noise(view, z).powi(2)).max(0.0).sqrt()
}

/// Returns the median error of depth at `z`, metres, in the ball's radius.
fn depth_noise(view: &FrameView, z: f64) -> f64 {
    view.parameters.curvature.depth_noise * z * z / view.ball_radius
}
