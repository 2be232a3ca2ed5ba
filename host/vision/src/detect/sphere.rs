//! Balls in the depth picture: places where something of the ball's colour ends where a ball there
//! would end, and the sphere of its size that fits the depth there.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use nalgebra::{Matrix3, Point3, Vector3};

use super::coarse::Coarse;
use super::picture::{Disc, Picture};
use crate::localise::DepthView;

/// A pixel with less of the ball's colour is another thing's.
pub(super) const COLOURED: f32 = 0.14;
/// In how many directions it is asked whether a sphere ends.
const SIDES: u32 = 16;
/// Part of the colour of a pixel that another one of the same thing has at least.
const SAME: f32 = 0.4;
/// Where it is asked whether a thing ends, in a ball's radius and in pixels more; in how many
/// directions; in how many of them it must end.
const BEYOND: (f64, f64) = (1.5, 2.0);
const DIRECTIONS: [(f64, f64); 8] = [
    (1.0, 0.0),
    (DIAGONAL, DIAGONAL),
    (0.0, 1.0),
    (-DIAGONAL, DIAGONAL),
    (-1.0, 0.0),
    (-DIAGONAL, -DIAGONAL),
    (0.0, -1.0),
    (DIAGONAL, -DIAGONAL),
];
const DIAGONAL: f64 = FRAC_1_SQRT_2;
const MIN_ENDS: usize = 6;
/// Where it is asked whether the thing is there, in a ball's radius; in how many of four places it
/// must be.
const WITHIN: f64 = 0.45;
const MIN_WITHIN: usize = 2;
/// A ball of so many pixels is large.
const LARGE: f64 = 14.0;
/// Spots that a sphere is fitted to.
const MOST_SPOTS: usize = 14;
/// Pixels of the depth picture on a sphere's diameter that are read.
const GRID: f64 = 10.0;
/// Steps of its fit, and how far a pixel may be off in the last ones, in the ball's radius.
const STEPS: [f64; 5] = [1.0, 0.7, 0.5, 0.35, 0.3];
/// Less of a sphere than this is none.
const HOPELESS: f64 = 0.12;
/// Fewer pixels make no sphere.
const MIN_PIXELS: usize = 6;

/// A place for a ball in the depth picture.
#[derive(Debug, Clone, Copy)]
struct Spot {
    /// Mean column, row and depth (pixels, metres) of the coarse pixels that speak for it.
    mean: [f64; 3],
    /// How many they are, those that speak more clearly counting more.
    count: f64,
}

impl Spot {
    /// With one more pixel, which counts `weight`.
    fn add(&mut self, pixel: [f64; 3], weight: f64) {
        self.count += weight;
        for (mean, x) in self.mean.iter_mut().zip(pixel) {
            *mean += (x - *mean) * weight / self.count;
        }
    }
}

/// Looks for them.
pub(super) struct Depths<'a> {
    pub(super) picture: &'a Picture<'a>,
    pub(super) depth: &'a DepthView<'a>,
    /// The ball's radius, metres.
    pub(super) ball_radius: f64,
}

/// The coarse picture with its depth.
struct Blocks<'a> {
    coarse: &'a Coarse,
    /// Of each pixel with something of the ball's colour, metres; infinite where there is none.
    depths: Vec<f64>,
    ball_radius: f64,
}

impl Blocks<'_> {
    /// Whether a coloured pixel may be near the middle of a ball seen with `radius` pixels: the
    /// surface is around it, but no longer where a ball would have ended. How clearly, up to 1.
    fn may_be_within(&self, [u, v, z]: [f64; 3], likeness: f32, radius: f64) -> Option<f64> {
        let coloured = (SAME * likeness).max(COLOURED / 2.0);
        // Coloured, and no farther behind than a ball reaches: what goes on towards the camera is
        // no end.
        let is_it = |(du, dv): (f64, f64), reach: f64| {
            self.coarse.index(u + reach * du, v + reach * dv).is_some_and(|i| {
                self.coarse.values()[i] >= coloured && self.depths[i] < z + self.ball_radius
            })
        };
        let around = DIRECTIONS.iter().step_by(2).filter(|&&way| is_it(way, WITHIN * radius));
        if around.take(MIN_WITHIN).count() < MIN_WITHIN {
            return None;
        }
        let reach = BEYOND.0 * radius + BEYOND.1;
        let goes_on = DIRECTIONS.iter().filter(|&&way| is_it(way, reach));
        let most = DIRECTIONS.len() - MIN_ENDS + 1;
        let more = most.checked_sub(goes_on.take(most).count())?;
        (more > 0).then(|| more as f64 / most as f64)
    }
}

impl Depths<'_> {
    /// The spheres that may be the ball, the likeliest first.
    pub(super) fn spheres(&self, coarse: &Coarse) -> Vec<Point3<f64>> {
        let mut spots: Vec<Spot> = Vec::new();
        let mut depths = Vec::with_capacity(coarse.values().len());
        coarse.each(|u, v, likeness| {
            let z = if likeness < COLOURED / 2.0 { None } else { self.about(u, v) };
            depths.push(z.unwrap_or(f64::INFINITY));
        });
        let blocks = Blocks { coarse, depths, ball_radius: self.ball_radius };
        let mut depths = blocks.depths.iter();
        coarse.each(|u, v, likeness| {
            let z = depths.next().filter(|z| likeness >= COLOURED && z.is_finite());
            if let Some(&z) = z {
                self.note([u, v, z], likeness, &blocks, &mut spots);
            }
        });
        // How much of a ball's middle speaks for it.
        let share = |spot: &Spot| spot.count * spot.mean[2].powi(2);
        spots.sort_by(|a, b| share(b).total_cmp(&share(a)));
        let fitted = spots.iter().take(MOST_SPOTS).filter_map(|spot| self.fit(spot.mean));
        let mut spheres: Vec<(Point3<f64>, f64)> =
            fitted.map(|(centre, filled)| (centre, filled * self.ends(&centre))).collect();
        spheres.sort_by(|a, b| b.1.total_cmp(&a.1));
        spheres
            .into_iter()
            .filter(|(_, quality)| *quality > HOPELESS)
            .map(|(centre, _)| centre)
            .collect()
    }

    /// Counts a coloured pixel to the spot that it speaks for, if it does for one.
    fn note(&self, pixel: [f64; 3], likeness: f32, blocks: &Blocks, spots: &mut Vec<Spot>) {
        let [u, v, z] = pixel;
        let radius = self.picture.intrinsics().radius_at(self.ball_radius, z + self.ball_radius);
        // Of a large ball a quarter of the pixels is enough.
        let weight = if radius > LARGE { 4.0 } else { 1.0 };
        let left_out =
            radius > LARGE && [u, v].iter().any(|k| (k / Coarse::SHRINK) as usize % 2 == 1);
        if left_out || !(2.0..=400.0).contains(&radius) {
            return;
        }
        let Some(speaks) = blocks.may_be_within(pixel, likeness, radius) else { return };
        let near = spots.iter_mut().find(|Spot { mean: [a, b, c], .. }| {
            (c - z).abs() < self.ball_radius && (a - u).powi(2) + (b - v).powi(2) < radius * radius
        });
        match near {
            Some(spot) => spot.add(pixel, weight * speaks),
            None => spots.push(Spot { mean: pixel, count: weight * speaks }),
        }
    }

    /// The sphere about a blob whose surface has depth `z`, metres, if there is one.
    pub(super) fn sphere_at(&self, disc: &Disc, z: f64) -> Option<Point3<f64>> {
        let (centre, filled) = self.fit([disc.u, disc.v, z])?;
        (filled * self.ends(&centre) > HOPELESS).then_some(centre)
    }

    /// Part of the directions in which nothing is as near as a ball at `centre` where it has ended.
    fn ends(&self, centre: &Point3<f64>) -> f64 {
        let Some(disc) = seen(self.picture, centre, self.ball_radius) else { return 0.0 };
        let reach = BEYOND.0 * disc.radius + BEYOND.1;
        let ends = (0..SIDES).filter(|&i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(SIDES)).sin_cos();
            let beside = self.depth.at(disc.u + reach * cos, disc.v + reach * sin);
            beside.is_none_or(|o| o > centre.z || o < centre.z - 2.5 * self.ball_radius)
        });
        ends.count() as f64 / f64::from(SIDES)
    }

    /// The depth about the middle of a coarse pixel: that of the first of five pixels that has any.
    fn about(&self, u: f64, v: f64) -> Option<f64> {
        let places = [(0.5, 0.5), (-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)];
        places.iter().find_map(|(du, dv)| self.depth.at(u + du, v + dv))
    }

    /// The centre (camera axes, metres) of the sphere of the ball's radius that fits the coloured
    /// depth around a pixel with depth: least squares of the points' distances from it, far ones
    /// cut off. With it goes how much of the ball's disc is on that sphere, 0 to 1.
    fn fit(&self, [u, v, z]: [f64; 3]) -> Option<(Point3<f64>, f64)> {
        let (lens, ball) = (self.picture.intrinsics(), self.ball_radius);
        let radius = lens.radius_at(ball, z + ball);
        let mut centre = lens.deproject(u, v, z + 0.8 * ball);
        let mut points = self.points(&centre, radius);
        let mut on_it = 0.0;
        for (step, cut) in STEPS.iter().enumerate() {
            if step == 2 {
                points = self.points(&centre, radius);
            }
            on_it = 0.0;
            let (mut normal, mut right, mut n) = (Matrix3::identity() * 1e-3, Vector3::zeros(), 0);
            for point in &points {
                let way = point - centre;
                let distance = way.norm();
                let off = (distance - ball) / (cut * ball);
                // What is behind the centre is no part of the ball that one sees.
                if off.abs() >= 1.0 || distance < 1e-9 || way.dot(&centre.coords) > 0.0 {
                    continue;
                }
                let (weight, row) = ((1.0 - off * off).powi(2), way / distance);
                normal += row * row.transpose() * weight;
                right += row * (distance - ball) * weight;
                n += 1;
                on_it += weight;
            }
            if n < MIN_PIXELS {
                return None;
            }
            let moved = normal.try_inverse()? * right;
            centre += moved * (0.7 * ball / moved.norm()).min(1.0);
        }
        let step = (2.0 * radius / GRID).max(1.0);
        let whole = std::f64::consts::PI * (radius / step).powi(2);
        (centre.z > 2.0 * ball).then_some((centre, (on_it / whole).min(1.0)))
    }

    /// What has depth and the ball's colour around where a centre is seen, as points in camera
    /// axes.
    fn points(&self, centre: &Point3<f64>, radius: f64) -> Vec<Point3<f64>> {
        let lens = self.picture.intrinsics();
        let Some((u, v)) = lens.project(centre) else { return Vec::new() };
        let step = (2.0 * radius / GRID).max(1.0);
        let reach = (1.15 * radius / step).ceil() as i32;
        let mut points = Vec::new();
        for j in -reach..=reach {
            for i in -reach..=reach {
                let [x, y] = [u + f64::from(i) * step, v + f64::from(j) * step]
                    .map(|k| (k + 0.5) as i32)
                    .map(f64::from);
                if (x - u).powi(2) + (y - v).powi(2) > (1.15 * radius).powi(2) {
                    continue;
                }
                let Some(z) = self.depth.at(x, y) else { continue };
                if (z - centre.z).abs() < 1.6 * self.ball_radius
                    && self.picture.likeness(x, y) >= COLOURED
                {
                    points.push(lens.deproject(x, y, z));
                }
            }
        }
        points
    }
}

/// Where a sphere is seen, and how large a ball as far away on the optical axis.
pub(super) fn seen(picture: &Picture, centre: &Point3<f64>, ball_radius: f64) -> Option<Disc> {
    let (u, v) = picture.intrinsics().project(centre)?;
    Some(Disc { u, v, radius: picture.intrinsics().radius_at(ball_radius, centre.z) })
}
