//! From a circle in the image to a position in the rig frame.
//!
//! Every pixel of the ball says by itself how far the ball's centre is. With camera axes, c = (x,
//! y, 1) on the ray to the centre and P = z_s (x_s, y_s, 1) the surface point that a pixel sees at
//! depth z_s, the centre z c lies a ball's radius R from P and behind it:
//!
//! ```text
//! |P - z c|² = R²   =>   z = (P·c + sqrt((P·c)² - |c|² (|P|² - R²))) / |c|²
//! ```
//!
//! For a ball far away that is the way R sqrt(1 - ρ²/R²) from the surface to the centre at ρ from
//! the middle of the disc: R in the middle, 2R/3 in the mean over the disc, R/√2 in its median.
//! Taken pixel by pixel it is right for whatever part of the disc has depth, and the median over
//! the pixels is then the centre's.

use nalgebra::{Matrix3, Vector3};

use crate::camera::{Camera, Intrinsics};
use crate::depth_view::DepthView;
use crate::frame::RgbdFrame;
use crate::observation::{Circle, Gaussian3};

/// Part of the disc's radius that is read: at the edge a depth camera mixes ball and background.
const MASK: f64 = 0.85;
/// Part of the disc's pixels in the picture that must agree on the centre's depth.
const MIN_SUPPORT: f64 = 0.1;
/// And so many of them at least.
const MIN_PIXELS: usize = 5;
/// What a group of votes may span, in the ball's radius.
const GROUP: f64 = 0.6;
/// Votes that have their error in common: noise of depth is smooth.
const ALIKE: f64 = 8.0;
/// What all votes have in common (standard deviation), metres at 1 m; as disparity's, it grows with
/// the square.
const BIAS: f64 = 0.000_5;
/// How a disc is read that has been fitted, and one that is about to be and is compared with many.
const FINELY: Reading = Reading { grid: 48.0, size_error: 0.05 };
const ROUGHLY: Reading = Reading { grid: 14.0, size_error: 0.1 };

/// How the depth on a disc is read.
struct Reading {
    /// Pixels read along the disc's diameter; larger discs are read in a coarser grid.
    grid: f64,
    /// The disc's radius may be wrong by this, in itself.
    size_error: f64,
}

/// What the depth picture says of a ball's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CentreDepth {
    /// Depth of the centre along the optical axis, metres.
    pub depth: f64,
    /// Part of the disc's pixels in the picture (0 to 1) that agree on it within half a ball's
    /// radius.
    pub support: f64,
    /// Standard deviation of the depth, metres.
    pub error: f64,
}

/// Returns the centre, in the rig frame, of the ball that is seen as `circle`.
///
/// The depth is the median of the votes of the pixels on the disc. Returns `None` if too few pixels
/// have depth or agree on it.
pub fn localise(circle: &Circle, frame: &RgbdFrame, camera: &Camera) -> Option<Gaussian3> {
    let centre = centre_depth(circle, frame, camera.ball_diameter / 2.0)?;
    let lens = frame.intrinsics();
    let point = lens.deproject(circle.u, circle.v, centre.depth);
    let mut across = Matrix3::zeros();
    across.fixed_view_mut::<2, 2>(0, 0).copy_from(&circle.covariance);
    let pixel =
        Matrix3::from_diagonal(&Vector3::new(centre.depth / lens.fx, centre.depth / lens.fy, 0.0));
    let along = point.coords / point.z * centre.error;
    let seen = pixel * across * pixel + along * along.transpose();
    let turn = camera.pose.rotation.to_rotation_matrix();
    let covariance = turn * seen * turn.transpose();
    Some(Gaussian3 { mean: camera.pose * point, covariance })
}

/// The depth of the centre of a ball of radius `ball_radius` (metres) that is seen as `circle`.
///
/// Of the pixels' votes the densest group is taken (things in front of the ball and behind it vote
/// elsewhere), and of that the median. `None` where it is fewer than a tenth of the disc's pixels.
pub fn centre_depth(circle: &Circle, frame: &RgbdFrame, ball_radius: f64) -> Option<CentreDepth> {
    let disc = (circle.u, circle.v, circle.radius);
    agreed_depth(disc, &DepthView::new(frame), ball_radius, FINELY, |_, _| true)
}

/// As [`centre_depth`], of a disc (column, row, radius, pixels) that is not fitted yet, from fewer
/// pixels: those that `count`.
pub(crate) fn rough_centre_depth(
    disc: (f64, f64, f64),
    depth: &DepthView,
    ball_radius: f64,
    count: impl Fn(f64, f64) -> bool,
) -> Option<CentreDepth> {
    agreed_depth(disc, depth, ball_radius, ROUGHLY, count)
}

/// What the likeliest group of the votes on a disc says, of the pixels that `count`.
fn agreed_depth(
    disc: (f64, f64, f64),
    depth: &DepthView,
    ball_radius: f64,
    Reading { grid, size_error }: Reading,
    count: impl Fn(f64, f64) -> bool,
) -> Option<CentreDepth> {
    let (mut votes, pixels) = centre_votes(disc, depth, ball_radius, grid, count);
    let expected = depth.intrinsics().depth_of(ball_radius, disc.2);
    votes.sort_unstable_by(f64::total_cmp);
    // What is in front of the ball may be larger than what is seen of it, but is not of the size
    // that a ball there has.
    let group = likeliest(&votes, GROUP * ball_radius, expected, size_error);
    let support = group.len() as f64 / pixels.max(1) as f64;
    if group.len() < MIN_PIXELS || support < MIN_SUPPORT {
        return None;
    }
    let depth = median_of_sorted(group);
    // Half of the votes are between the quartiles, which are 1.35 standard deviations apart.
    let spread = (group[group.len() * 3 / 4] - group[group.len() / 4]) / 1.35;
    let proofs = (group.len() as f64 / ALIKE).max(1.0);
    let error = (spread / proofs.sqrt()).hypot(BIAS * depth * depth);
    Some(CentreDepth { depth, support, error })
}

/// What each pixel on the disc that counts says of the centre's depth, metres, and how many pixels
/// were asked.
fn centre_votes(
    (u, v, radius): (f64, f64, f64),
    depth: &DepthView,
    ball_radius: f64,
    grid: f64,
    counts: impl Fn(f64, f64) -> bool,
) -> (Vec<f64>, usize) {
    let mask = radius * MASK;
    let step = ((2.0 * radius / grid) as i32).max(1);
    let span = |centre: f64| ((centre - mask).ceil() as i32, (centre + mask).floor() as i32);
    let ((u0, u1), (v0, v1)) = (span(u), span(v));
    let (mut votes, mut pixels) = (Vec::new(), 0);
    for row in (v0..=v1).step_by(step as usize) {
        for column in (u0..=u1).step_by(step as usize) {
            let (x, y) = (f64::from(column), f64::from(row));
            if (x - u).powi(2) + (y - v).powi(2) > mask * mask || !depth.contains(x, y) {
                continue;
            }
            pixels += 1;
            let z = depth.at(x, y).filter(|_| counts(x, y));
            votes.extend(z.and_then(|z| vote(depth.intrinsics(), (u, v), (x, y), z, ball_radius)));
        }
    }
    (votes, pixels)
}

/// The depth of the centre, seen at pixel `centre`, of a ball whose surface is seen at `pixel` at
/// depth `z`, metres; `None` where no ball there would be hit by that pixel's ray.
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

/// Of the runs of `sorted` that span no more than `width` the longest, those weighing less that are
/// far from `expected` (standard deviation of the logarithm: `size_error`).
fn likeliest(sorted: &[f64], width: f64, expected: f64, size_error: f64) -> &[f64] {
    let (mut best, mut most, mut start) = (0..0, 0.0, 0);
    for (end, &z) in sorted.iter().enumerate() {
        while z - sorted[start] > width {
            start += 1;
        }
        let count = (end + 1 - start) as f64;
        if 1.05 * count <= most {
            continue;
        }
        let off = ((z + sorted[start]) / (2.0 * expected)).ln() / size_error;
        let weight = count * (0.05 + (-off * off / 2.0).exp());
        if weight > most {
            (best, most) = (start..end + 1, weight);
        }
    }
    &sorted[best]
}

/// The median of a sorted slice that is not empty.
fn median_of_sorted(sorted: &[f64]) -> f64 {
    let n = sorted.len();
    (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Point3, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::image::Image;

    const INTRINSICS: Intrinsics =
        Intrinsics { fx: 525.0, fy: 520.0, cx: 159.5, cy: 119.5, depth_scale: 10_000.0 };

    fn camera(ball_radius: f64) -> Camera {
        let pose = Isometry3::new(Vector3::new(1.0, -0.5, 0.3), Vector3::new(0.3, -1.2, 0.8));
        Camera { intrinsics: INTRINSICS, pose, ball_diameter: 2.0 * ball_radius, ball_hue: 0.0 }
    }

    /// The depth picture of a sphere in front of a wall 3 m away; `keep` says which pixels have
    /// depth.
    fn render(
        centre: &Point3<f64>,
        radius: f64,
        keep: impl Fn(i32, i32) -> Option<u16>,
    ) -> RgbdFrame {
        let depth = Image::from_fn(320, 240, |u, v| {
            // |z d - centre| = radius, the nearer root.
            let d = INTRINSICS.deproject(u as f64, v as f64, 1.0).coords;
            let b = d.dot(&centre.coords);
            let disc = b * b - d.norm_squared() * (centre.coords.norm_squared() - radius * radius);
            let z = if disc >= 0.0 { (b - disc.sqrt()) / d.norm_squared() } else { 3.0 };
            let surface = (z * INTRINSICS.depth_scale).round() as u16;
            keep(u as i32, v as i32).unwrap_or(surface)
        });
        RgbdFrame::new(0.0, Image::filled(320, 240, [0; 3]), depth, INTRINSICS).unwrap()
    }

    fn circle(centre: &Point3<f64>, ball_radius: f64) -> Circle {
        let (u, v) = INTRINSICS.project(centre).unwrap();
        Circle::rough(u, v, 520.0 * ball_radius / centre.z)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn a_rendered_sphere_is_localised_within_a_millimetre(
            z in 0.4..2.0f64, x in -0.15..0.15f64, y in -0.1..0.1f64, radius in 0.015..0.04f64,
            holes in 0..3i32, side in prop::bool::ANY,
        ) {
            let centre = Point3::new(x * z, y * z, z);
            let middle = INTRINSICS.project(&centre).unwrap().0 as i32;
            // Holes in a pattern, and half of the ball without depth: the rest must say the same.
            let frame = render(&centre, radius, |u, v| {
                let hole = (u + 2 * v) % 4 < holes || (side && u < middle);
                hole.then_some(0)
            });
            let camera = camera(radius);
            let found = localise(&circle(&centre, radius), &frame, &camera).unwrap();
            prop_assert!((camera.depth_of(&found.mean) - z).abs() < 1e-3, "{found:?} {z}");
            prop_assert!((found.mean - camera.pose * centre).norm() < 1e-3);
        }

        #[test]
        fn a_thing_in_front_of_a_third_of_it_does_not_matter(z in 0.5..1.5f64, near in 0.1..0.3f64) {
            let centre = Point3::new(0.02, 0.01, z);
            let seen = circle(&centre, 0.03);
            let edge = (seen.u - 0.3 * seen.radius) as i32;
            let cover = ((z - near) * INTRINSICS.depth_scale) as u16;
            let frame = render(&centre, 0.03, |u, _| (u < edge).then_some(cover));
            let camera = camera(0.03);
            let found = localise(&seen, &frame, &camera).unwrap();
            prop_assert!((camera.depth_of(&found.mean) - z).abs() < 2e-3, "{found:?} {z}");
        }
    }

    #[test]
    fn a_larger_thing_before_it_is_not_taken_for_it() {
        // Two thirds of it are hidden, but at that depth it would be seen twice as large.
        let centre = Point3::new(0.02, 0.01, 1.0);
        let seen = circle(&centre, 0.03);
        let edge = (seen.u + 0.3 * seen.radius) as i32;
        let frame = render(&centre, 0.03, |u, _| (u < edge).then_some(5000));
        let camera = camera(0.03);
        let found = localise(&seen, &frame, &camera).unwrap();
        assert!((camera.depth_of(&found.mean) - 1.0).abs() < 2e-3, "{found:?}");
    }

    #[test]
    fn the_covariance_is_that_of_pixels_and_depth_in_the_rig_frame() {
        let centre = Point3::new(0.0, 0.0, 1.3);
        let mut seen = circle(&centre, 0.03);
        seen.covariance = nalgebra::Matrix2::new(4.0, 0.0, 0.0, 1.0);
        let (frame, camera) = (render(&centre, 0.03, |_, _| None), camera(0.03));
        let found = localise(&seen, &frame, &camera).unwrap();
        let sd = |axis: Vector3<f64>| {
            let axis = camera.pose.rotation * axis;
            axis.dot(&(found.covariance * axis)).sqrt()
        };
        assert!((sd(Vector3::x()) / (2.0 * 1.3 / 525.0) - 1.0).abs() < 0.01);
        assert!((sd(Vector3::y()) / (1.3 / 520.0) - 1.0).abs() < 0.01);
        assert!((0.000_5..0.002).contains(&sd(Vector3::z())), "{}", sd(Vector3::z()));
    }

    #[test]
    fn too_little_depth_is_none() {
        let centre = Point3::new(0.0, 0.0, 1.0);
        let seen = circle(&centre, 0.03);
        let dotted = |every: i32| {
            render(&centre, 0.03, move |u, v| (u % every + v % every != 0).then_some(0))
        };
        assert!(localise(&seen, &dotted(2), &camera(0.03)).is_some());
        assert!(localise(&seen, &dotted(4), &camera(0.03)).is_none());
        let outside = Circle { u: -50.0, ..seen };
        assert!(localise(&outside, &dotted(1), &camera(0.03)).is_none());
        let absurd = Circle { radius: f64::NAN, ..seen };
        assert!(localise(&absurd, &dotted(1), &camera(0.03)).is_none());
    }
}
