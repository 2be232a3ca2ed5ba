//! Whether an outline is a ball's: its shape, its size against depth, and what is around it.

use nalgebra::{Matrix4, Vector4};

use super::outline::{Outline, Picture, RAYS, Rim};
use crate::camera::Intrinsics;
use crate::detect::Detection;
use crate::locate::{DepthView, rough_centre_depth};

/// Where the depth outside a disc is read, in its radius and in pixels more: beyond the pixels that mix ball
/// and background, and beyond what depth may be shifted against colour.
const OUTSIDE: (f64, f64) = (1.4, 2.0);
/// A ball's size by its picture over that by its depth is wrong by this (standard deviation of the
/// logarithm).
const SIZE_ERROR: f64 = 0.12;
/// Part of the disc's pixels that must agree on its depth for it to be taken as known.
const KNOWN: f64 = 0.2;
/// What is left of the score of a ball whose depth is not known.
const UNKNOWN: f64 = 0.7;
/// Part of the radius within which a surface's shape is read, and readings across it.
const SURFACE: (f64, i32) = (0.85, 9);

/// The radius (pixels, on the optical axis) of a ball of radius `ball_radius` at depth `z`, metres.
pub(super) fn radius_at(intrinsics: &Intrinsics, ball_radius: f64, z: f64) -> f64 {
    (intrinsics.fx + intrinsics.fy) / 2.0 * ball_radius / z
}

/// What outlines are judged by.
pub(super) struct Judge<'a> {
    pub(super) picture: &'a Picture<'a>,
    pub(super) depth: &'a DepthView<'a>,
    /// The ball's radius, metres.
    pub(super) ball_radius: f64,
}

impl Judge<'_> {
    /// How sure it is that `outline` is the ball's: 0 to 1. A product, so that each doubt is enough: too
    /// little of the outline seen, too little of the disc red, too little contrast, another size than the
    /// depth asks for, a surface that goes on beside it or is not round.
    pub(super) fn score(&self, outline: &Outline) -> f64 {
        if outline.support() < 0.25 || outline.fill < 0.35 || outline.contrast < 0.1 {
            return 0.0;
        }
        let depth = self.centre(outline);
        let by_picture = radius_at(self.picture.intrinsics(), self.ball_radius, outline.disc.radius);
        let z = depth.unwrap_or(by_picture);
        let around = self.around(outline, z);
        let free = around.part(Side::Free);
        let uncovered = free / (1.0 - around.part(Side::Covered)).max(0.01);
        let shape = ramp(free, 0.25, 0.45) * ramp(uncovered, 0.4, 0.8) * ramp(outline.fill, 0.35, 0.6);
        if shape == 0.0 {
            return 0.0;
        }
        if depth.is_none() {
            let clear = ramp(outline.contrast, 0.15, 0.35) * ramp(free, 0.5, 0.8);
            return UNKNOWN * shape * clear;
        }
        let off = (by_picture / z).ln() / SIZE_ERROR;
        shape
            * ramp(outline.contrast, 0.1, 0.2)
            * (0.8 + 0.2 * ramp(outline.contrast, 0.15, 0.4))
            * (-off * off / 2.0).exp()
            * (1.0 - ramp(around.part(Side::Attached), 0.05, 0.2))
            * roundness(outline, self.depth, z, self.ball_radius).map_or(1.0, |g| ramp(g, 0.15, 0.55))
    }

    /// The outline fitted again without the edges of what covers the ball; `None` where nothing does, or
    /// where too little of the ball's own edge would be left.
    pub(super) fn uncovered(&self, outline: &Outline) -> Option<Outline> {
        let z = self.centre(outline)?;
        let around = self.around(outline, z);
        if around.part(Side::Covered) < 0.05 || around.part(Side::Free) < 0.3 {
            return None;
        }
        let trusted = around.sides.map(|side| side == Some(Side::Free));
        let radius = radius_at(self.picture.intrinsics(), self.ball_radius, z);
        Some(self.picture.fit_again(outline, radius, &trusted))
    }

    /// Depth of the ball's centre, metres, where enough of the disc agrees on it.
    fn centre(&self, outline: &Outline) -> Option<f64> {
        let known = rough_centre_depth(&detection(outline, 0.0), self.depth, self.ball_radius)?;
        (known.support >= KNOWN).then_some(known.depth)
    }

    /// What is around a ball at depth `z`.
    fn around(&self, outline: &Outline, z: f64) -> Around {
        let side = |ray: usize| {
            if outline.rims[ray] == Rim::Unseen {
                return None;
            }
            let pixel =
                self.picture.pixel_on_ray(&outline.disc, ray, OUTSIDE.0 + OUTSIDE.1 / outline.disc.radius);
            let outside = pixel.and_then(|(u, v)| self.depth.at(u, v));
            Some(match outside {
                Some(o) if o <= z && outline.rims[ray] == Rim::Red => Side::Attached,
                Some(o) if o <= z - 1.2 * self.ball_radius => Side::Covered,
                Some(o) if o <= z => Side::Attached,
                _ if outline.rims[ray] == Rim::Edge => Side::Free,
                _ => Side::Open,
            })
        };
        Around { sides: std::array::from_fn(side) }
    }
}

/// What is beside a disc at the end of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    /// The ball itself ends there: redness drops, and what is there is behind it or has no depth.
    Free,
    /// The same without an edge.
    Open,
    /// Something as near as the ball's surface (a print on a box has the box around it), or red and nearer.
    Attached,
    /// Something else, nearer.
    Covered,
}

/// What is around a disc, ray by ray; `None` out of the picture.
struct Around {
    sides: [Option<Side>; RAYS],
}

impl Around {
    /// Part of the rays within the picture (taken to be a quarter at least: a sliver of a ball is none) that
    /// show `side`.
    fn part(&self, side: Side) -> f64 {
        let all = self.sides.iter().flatten().count().max(RAYS / 4);
        self.sides.iter().filter(|&&s| s == Some(side)).count() as f64 / all as f64
    }
}

/// The detection that an outline makes.
pub(super) fn detection(outline: &Outline, score: f64) -> Detection {
    Detection { u: outline.disc.u, v: outline.disc.v, radius: outline.disc.radius, score }
}

/// How round the surface on a disc is: 1 a sphere of `ball_radius`, 0 a plane however inclined; as much more
/// as it might be within 1.5 standard errors. `None` where too little of it has depth to say.
///
/// Least squares of depth = a + b x + c y - g s, s = sqrt(R² - x² - y²) the height of a sphere over its
/// middle plane, of the pixels whose depth is within a ball of depth `z` of its centre.
fn roundness(outline: &Outline, depth: &DepthView, z: f64, ball_radius: f64) -> Option<f64> {
    let (disc, (part, half)) = (&outline.disc, SURFACE);
    let (mut normal, mut right, mut squares, mut n) = (Matrix4::zeros(), Vector4::zeros(), 0.0, 0.0);
    for i in -half..=half {
        for j in -half..=half {
            let [x, y] = [i, j].map(|k| f64::from(k) / f64::from(half) * part);
            let height = 1.0 - x * x - y * y;
            let at = depth.at(disc.u + x * disc.radius, disc.v + y * disc.radius);
            let Some(off) = at.map(|d| (d - z) / ball_radius) else { continue };
            if height < 1.0 - part * part || !(-1.5..=0.5).contains(&off) {
                continue;
            }
            let row = Vector4::new(1.0, x, y, -height.sqrt());
            normal += row * row.transpose();
            right += row * off;
            squares += off * off;
            n += 1.0;
        }
    }
    let inverse = normal.try_inverse()?;
    let fit = inverse * right;
    let variance = (squares - fit.dot(&right)).max(0.0) / (n - 4.0);
    (n >= 12.0).then(|| fit.w + 1.5 * (variance * inverse[(3, 3)]).sqrt())
}

/// 0 up to `low`, 1 from `high`, straight between.
fn ramp(x: f64, low: f64, high: f64) -> f64 {
    ((x - low) / (high - low)).clamp(0.0, 1.0)
}
