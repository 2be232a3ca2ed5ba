//! Localisation: from a circle in the image to a position in the rig frame.
//!
//! Each pixel of the ball gives an estimate ("vote") of the depth of the ball's centre. With camera
//! axes, c = (x, y, 1) on the ray to the centre, and P = z_s (x_s, y_s, 1) the surface point of a
//! pixel with depth z_s, the centre z c lies a ball's radius R from P, behind it:
//!
//! ```text
//! |P - z c|² = R²   =>   z = (P·c + sqrt((P·c)² - |c|² (|P|² - R²))) / |c|²
//! ```
//!
//! For a distant ball this adds R sqrt(1 - ρ²/R²) to the depth of a surface point at distance ρ
//! from the middle of the disc: R in the middle, 2R/3 in the mean over the disc, R/√2 in the
//! median. As it is added for each pixel, it is right for whatever part of the disc has depth, and
//! the median of the votes is the centre's depth.
//!
//! Without depth, the plane of the ball gives the position ([`localise_on_plane`]), or the size of
//! its outline ([`localise_by_outline`]).

use crate::camera::{Camera, Intrinsics};
use crate::depth_view::DepthView;
use crate::frame::RgbdFrame;
use crate::observation::{BallObservation, Circle, Gaussian3, TwoDepths};
use propagation::{across, in_rig_frame};

mod on_plane;
mod outline;
mod propagation;

pub use on_plane::localise_on_plane;
pub use outline::localise_by_outline;

/// Parameters of the localisation.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LocaliseParameters {
    /// Part of the disc's radius that is read: at the edge a depth camera mixes ball and
    /// background.
    mask: f64,
    /// Least part of the disc's pixels in the image that must agree on the centre's depth.
    min_support: f64,
    /// Least number of those pixels.
    min_pixels: usize,
    /// Largest span of the votes that agree, in the ball's radius.
    group_span: f64,
    /// Number of neighbouring votes that share their error: the noise of depth is smooth.
    correlated_votes: f64,
    /// Standard deviation of the error that all votes share, metres at a depth of 1 m. It grows
    /// with the square of the depth, as that of a disparity does.
    bias: f64,
    /// Pixels that are read along the disc's diameter; larger discs are read in a coarser grid.
    grid: f64,
    /// Relative standard deviation of the disc's radius.
    size_error: f64,
}

impl LocaliseParameters {
    /// Parameters for a refined circle.
    const DEFAULT: Self = Self {
        mask: 0.85,
        min_support: 0.1,
        min_pixels: 5,
        group_span: 0.6,
        correlated_votes: 8.0,
        bias: 0.000_5,
        grid: 48.0,
        size_error: 0.05,
    };
    /// Parameters for a disc that is not refined yet and is compared with many others.
    const ROUGH: Self = Self { grid: 14.0, size_error: 0.1, ..Self::DEFAULT };
}

/// Depth of a ball's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CentreDepth {
    /// Depth along the optical axis, metres.
    pub(crate) depth: f64,
    /// Part of the disc's pixels in the image that agree on it, 0 to 1.
    pub(crate) support: f64,
    /// Standard deviation of the depth, metres.
    error: f64,
}

/// Returns the observation of a ball that is seen as `circle`, with the position that the frame's
/// depth gives (see [`localise`]), or of a camera without depth the ball's plane
/// (see [`localise_on_plane`]) or the outline (see [`localise_by_outline`]).
pub fn observe(circle: Circle, score: f64, frame: &RgbdFrame, camera: &Camera) -> BallObservation {
    let position = match (frame.intrinsics().has_depth(), camera.is_planar) {
        (true, _) => localise(&circle, frame, camera),
        (false, true) => localise_on_plane(&circle, frame.intrinsics(), camera),
        (false, false) => localise_by_outline(&circle, frame.intrinsics(), camera),
    };
    BallObservation { stamp: frame.time(), circle, score, position, depths: None }
}

/// Returns the two depths of the ball that is seen as `circle`: of an outline of `radius` pixels,
/// and of `position`, which the frame's depth gives.
pub(crate) fn two_depths(
    circle: &Circle,
    radius: f64,
    position: &Gaussian3,
    (intrinsics, camera): (&Intrinsics, &Camera),
) -> Option<TwoDepths> {
    let by_outline = localise_by_outline(&Circle { radius, ..*circle }, intrinsics, camera)?;
    let [by_outline, by_pixels] = [&by_outline, position].map(|it| camera.depth_of(&it.mean));
    Some(TwoDepths { by_outline, by_pixels })
}

/// Returns the centre, in the rig frame, of the ball that is seen as `circle`.
///
/// The covariance is that of the circle's centre and of the depth. Returns `None` if too few pixels
/// have depth or agree on it.
pub fn localise(circle: &Circle, frame: &RgbdFrame, camera: &Camera) -> Option<Gaussian3> {
    let centre = centre_depth(circle, frame, camera.ball_diameter / 2.0)?;
    let intrinsics = frame.intrinsics();
    let point = intrinsics.deproject(circle.u, circle.v, centre.depth);
    let across = across(circle, centre.depth, intrinsics)?;
    let along = point.coords / point.z * centre.error;
    let in_camera = across * circle.covariance * across.transpose() + along * along.transpose();
    Some(in_rig_frame(camera, &point, &in_camera))
}

/// Returns the depth of the centre of a ball of radius `ball_radius` (metres) that is seen as
/// `circle`.
///
/// The densest group of votes counts, because objects in front of the ball and behind it vote for
/// other depths; its median is the depth. Returns `None` if the group is too small.
fn centre_depth(circle: &Circle, frame: &RgbdFrame, ball_radius: f64) -> Option<CentreDepth> {
    let depth = DepthView::new(frame);
    agreed_depth(circle, &depth, ball_radius, &LocaliseParameters::DEFAULT, |_, _| true)
}

/// As [`centre_depth`], of a circle that is not refined yet, from fewer pixels: those that `counts`
/// accepts.
pub(crate) fn rough_centre_depth(
    circle: &Circle,
    depth: &DepthView,
    ball_radius: f64,
    counts: impl Fn(f64, f64) -> bool,
) -> Option<CentreDepth> {
    agreed_depth(circle, depth, ball_radius, &LocaliseParameters::ROUGH, counts)
}

/// Returns the depth that the likeliest group of votes agrees on.
fn agreed_depth(
    circle: &Circle,
    depth: &DepthView,
    ball_radius: f64,
    parameters: &LocaliseParameters,
    counts: impl Fn(f64, f64) -> bool,
) -> Option<CentreDepth> {
    let Votes { mut depths, pixels } = read_votes(circle, depth, ball_radius, parameters, counts);
    let expected = depth.intrinsics().depth_of(ball_radius, circle.radius);
    depths.sort_unstable_by(f64::total_cmp);
    // An object in front of the ball may hide most of it, but it has not the size of a ball at its
    // depth.
    let span = parameters.group_span * ball_radius;
    let group = likeliest_group(&depths, span, expected, parameters.size_error);
    let support = group.len() as f64 / pixels.max(1) as f64;
    if group.len() < parameters.min_pixels || support < parameters.min_support {
        return None;
    }
    let depth = median_of_sorted(group);
    // Half of the votes lie between the quartiles, which are 1.35 standard deviations apart.
    let spread = (group[group.len() * 3 / 4] - group[group.len() / 4]) / 1.35;
    let independent = (group.len() as f64 / parameters.correlated_votes).max(1.0);
    let error = (spread / independent.sqrt()).hypot(parameters.bias * depth * depth);
    Some(CentreDepth { depth, support, error })
}

/// The votes on a disc.
struct Votes {
    /// Depths of the centre, metres.
    depths: Vec<f64>,
    /// Number of pixels that were read, with depth or without.
    pixels: usize,
}

/// Reads the votes of the pixels in the circle that `counts` accepts.
fn read_votes(
    &Circle { u, v, radius, .. }: &Circle,
    depth: &DepthView,
    ball_radius: f64,
    parameters: &LocaliseParameters,
    counts: impl Fn(f64, f64) -> bool,
) -> Votes {
    let mask = radius * parameters.mask;
    let step = ((2.0 * radius / parameters.grid) as i32).max(1) as usize;
    let span = |centre: f64| (centre - mask).ceil() as i32..=(centre + mask).floor() as i32;
    let mut votes = Votes { depths: Vec::new(), pixels: 0 };
    for row in span(v).step_by(step) {
        for column in span(u).step_by(step) {
            let (x, y) = (f64::from(column), f64::from(row));
            if (x - u).powi(2) + (y - v).powi(2) > mask * mask || !depth.contains(x, y) {
                continue;
            }
            votes.pixels += 1;
            let z = depth.at(x, y).filter(|_| counts(x, y));
            let vote = z.and_then(|z| vote(depth.intrinsics(), (u, v), (x, y), z, ball_radius));
            votes.depths.extend(vote);
        }
    }
    votes
}

/// Returns the depth of the centre, seen at pixel `centre`, of a ball whose surface is seen at
/// `pixel` at depth `z`, metres; `None` if that pixel's ray would miss the ball.
fn vote(
    intrinsics: &Intrinsics,
    centre: (f64, f64),
    pixel: (f64, f64),
    z: f64,
    ball_radius: f64,
) -> Option<f64> {
    let c = intrinsics.deproject(centre.0, centre.1, 1.0).coords;
    let p = intrinsics.deproject(pixel.0, pixel.1, z).coords;
    let along = p.dot(&c);
    let discriminant =
        along * along - c.norm_squared() * (p.norm_squared() - ball_radius * ball_radius);
    (discriminant >= 0.0).then(|| (along + discriminant.sqrt()) / c.norm_squared())
}

/// Returns the likeliest of the groups of `sorted` that span at most `width`: the largest one,
/// where groups far from `expected` weigh less (`size_error` is the standard deviation of the
/// logarithm).
fn likeliest_group(sorted: &[f64], width: f64, expected: f64, size_error: f64) -> &[f64] {
    /// Weight of a group at any depth, over that of a group at the expected depth.
    const ANY_DEPTH: f64 = 0.05;
    let (mut best, mut most, mut start) = (0..0, 0.0, 0);
    for (end, &z) in sorted.iter().enumerate() {
        while z - sorted[start] > width {
            start += 1;
        }
        let count = (end + 1 - start) as f64;
        if (1.0 + ANY_DEPTH) * count <= most {
            continue;
        }
        let distance = ((z + sorted[start]) / (2.0 * expected)).ln() / size_error;
        let weight = count * (ANY_DEPTH + (-distance * distance / 2.0).exp());
        if weight > most {
            (best, most) = (start..end + 1, weight);
        }
    }
    &sorted[best]
}

/// Returns the median of a sorted slice that is not empty.
fn median_of_sorted(sorted: &[f64]) -> f64 {
    let n = sorted.len();
    (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0
}

#[cfg(test)]
mod tests;
