//! How round a surface is in the depth picture.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::picture::Disc;
use crate::localise::DepthView;

/// Pixels that have the noise of depth in common.
const SMOOTH: f64 = 10.0;
/// Depth is read of what is so near to a sphere's surface, in its radius: cables before it are not.
const NEAR: f64 = 0.6;
/// Part of the radius within which a surface's shape is read.
const SURFACE: f64 = 0.85;
/// Readings from the middle to the edge.
pub(super) const FINELY: i32 = 9;
/// The same where many discs are compared.
pub(super) const ROUGHLY: i32 = 5;

/// How round the surface on a disc is, in the direction in which it is the flattest: 1 a sphere of
/// `ball_radius`, 0 a plane or a cylinder however inclined; 1.5 standard errors less and as much
/// more. `None` where too little of it has depth to say.
///
/// It is read at `half` places from the middle to the edge.
///
/// With x and y across the direction to a ball whose centre has depth `z`, and h along it, least
/// squares of h = a + b x + c y + d x² + e xy + f y² over the pixels that are near that ball's
/// surface; the smaller eigenvalue of the curvature over that of the ball at the same pixels.
pub(super) fn roundness(
    disc: &Disc,
    depth: &DepthView,
    z: f64,
    ball_radius: f64,
    half: i32,
) -> Option<(f64, f64)> {
    let part = SURFACE;
    let lens = depth.intrinsics();
    let centre = lens.deproject(disc.u, disc.v, z).coords;
    let ahead = centre.normalize();
    let right = (Vector3::x() - ahead * ahead.x).normalize();
    let down = ahead.cross(&right);
    let (mut normal, mut right_side, mut ideal) =
        (Matrix6::zeros(), Vector6::zeros(), Vector6::zeros());
    let (mut squares, mut n) = (0.0, 0.0);
    for i in -half..=half {
        for j in -half..=half {
            let [x, y] = [i, j].map(|k| f64::from(k) / f64::from(half) * part);
            let height = 1.0 - x * x - y * y;
            if height < 1.0 - part * part {
                continue;
            }
            let expected = centre + (right * x + down * y - ahead * height.sqrt()) * ball_radius;
            let Some((u, v)) = lens.project(&expected.into()).map(|(u, v)| (u.round(), v.round()))
            else {
                continue;
            };
            let Some(seen) = depth.at(u, v) else { continue };
            let off = (lens.deproject(u, v, seen).coords - centre) / ball_radius;
            let (x, y, off) = (off.dot(&right), off.dot(&down), off.dot(&ahead));
            let height = 1.0 - x * x - y * y;
            if height <= 0.0 || (off + height.sqrt()).abs() > NEAR {
                continue;
            }
            let row = Vector6::new(1.0, x, y, x * x, x * y, y * y);
            normal += row * row.transpose();
            right_side += row * off;
            ideal -= row * height.sqrt();
            squares += off * off;
            n += 1.0;
        }
    }
    if n < 14.0 {
        return None;
    }
    let inverse = normal.try_inverse()?;
    let (fit, ideal) = (inverse * right_side, inverse * ideal);
    let flattest = |f: &Vector6<f64>| (f[3] + f[5]) / 2.0 - ((f[3] - f[5]) / 2.0).hypot(f[4] / 2.0);
    let variance = (squares - fit.dot(&right_side)).max(0.0) / (n - 6.0);
    // Readings that share a pixel, or a patch of noise, are not each a proof.
    let readings = f64::from((2 * half + 1) * (2 * half + 1));
    let shared = (SMOOTH * readings / (2.0 * part * disc.radius).powi(2)).max(1.0);
    let error = (shared * variance * inverse[(3, 3)].max(inverse[(5, 5)])).sqrt();
    if !error.is_finite() {
        return None;
    }
    let ideal = flattest(&ideal).max(0.1);
    Some(((flattest(&fit) - 1.5 * error) / ideal, (flattest(&fit) + 1.5 * error) / ideal))
}

/// Part of the places in the picture whose depth is near the sphere of `ball_radius` whose centre
/// is at depth `z`, and how far off it that is (median), both in the ball's radius. `places` are on
/// the disc, in its radius.
pub(super) fn on_sphere(
    disc: &Disc,
    depth: &DepthView,
    z: f64,
    ball_radius: f64,
    places: impl Iterator<Item = (f64, f64)>,
) -> (f64, f64) {
    let lens = depth.intrinsics();
    let centre = lens.deproject(disc.u, disc.v, z).coords;
    let (mut offs, mut all) = (Vec::with_capacity(64), 0);
    for (x, y) in places {
        let (u, v) = (disc.u + x * disc.radius, disc.v + y * disc.radius);
        if !depth.contains(u, v) {
            continue;
        }
        all += 1;
        let Some(o) = depth.at(u, v) else { continue };
        let off =
            (lens.deproject(u.round(), v.round(), o).coords - centre).norm() / ball_radius - 1.0;
        if off.abs() < 1.0 {
            offs.push(off.abs());
        }
    }
    offs.sort_by(f64::total_cmp);
    (offs.len() as f64 / f64::from(all.max(1)), offs.get(offs.len() / 2).copied().unwrap_or(1.0))
}
