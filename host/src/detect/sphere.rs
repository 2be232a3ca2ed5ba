//! Balls in the depth picture: places where something of the ball's colour ends where a ball there would end, and the
//! sphere of its size that fits the depth there.

use nalgebra::{Matrix3, Point3, Vector3};

use super::judge::radius_at;
use super::outline::{Disc, Picture};
use super::propose::Coarse;
use crate::locate::DepthView;

/// A pixel with less of the ball's colour is another thing's.
const COLOURED: f32 = 0.14;
/// Part of the colour of a pixel that another one of the same thing has at least.
const SAME: f32 = 0.4;
/// Where it is asked whether a thing ends, in a ball's radius and in pixels more; in how many directions; in how many
/// of them it must end.
const BEYOND: (f64, f64) = (1.5, 2.0);
const DIRECTIONS: usize = 8;
const MIN_ENDS: usize = 6;
/// Where it is asked whether the thing is there, in a ball's radius; in how many of four places it must be.
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
pub(super) struct Spot {
    /// Sums of column, row and depth (pixels, metres) of the coarse pixels that speak for it.
    sums: [f64; 3],
    /// How many they are, those that speak more clearly counting more.
    count: f64,
}

impl Spot {
    fn mean(&self) -> [f64; 3] {
        self.sums.map(|s| s / self.count)
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
    /// Of each pixel with something of the ball's colour, metres.
    depths: Vec<Option<f64>>,
}

impl Blocks<'_> {
    /// Whether a coloured pixel may be near the middle of a ball seen with `radius` pixels: the surface is around it,
    /// but no longer where a ball would have ended. How clearly, up to 1.
    fn may_be_within(
        &self,
        [u, v, z]: [f64; 3],
        likeness: f32,
        radius: f64,
        ball_radius: f64,
    ) -> Option<f64> {
        let coloured = (SAME * likeness).max(COLOURED / 2.0);
        // Coloured, and no farther behind than a ball reaches: what goes on towards the camera is no end.
        let is_it = |u: f64, v: f64| {
            self.coarse.index(u, v).is_some_and(|i| {
                self.coarse.value(i) >= coloured && self.depths[i].is_some_and(|o| o < z + ball_radius)
            })
        };
        let reach = WITHIN * radius;
        let sides = [(reach, 0.0), (-reach, 0.0), (0.0, reach), (0.0, -reach)];
        if sides.iter().filter(|(du, dv)| is_it(u + du, v + dv)).count() < MIN_WITHIN {
            return None;
        }
        let reach = BEYOND.0 * radius + BEYOND.1;
        let ends = (0..DIRECTIONS).filter(|&i| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / DIRECTIONS as f64).sin_cos();
            !is_it(u + reach * cos, v + reach * sin)
        });
        let more = ends.count().checked_sub(MIN_ENDS)?;
        Some((more + 1) as f64 / (DIRECTIONS - MIN_ENDS + 1) as f64)
    }
}

impl Depths<'_> {
    /// The spheres that may be the ball, the likeliest first.
    pub(super) fn spheres(&self, coarse: &Coarse) -> Vec<Point3<f64>> {
        let mut spots: Vec<Spot> = Vec::new();
        let blocks = Blocks {
            coarse,
            depths: coarse
                .pixels()
                .map(|(u, v, likeness)| if likeness < COLOURED / 2.0 { None } else { self.about(u, v) })
                .collect(),
        };
        for ((u, v, likeness), z) in coarse.pixels().zip(&blocks.depths) {
            let Some(z) = z.filter(|_| likeness >= COLOURED) else { continue };
            let radius = radius_at(self.picture.intrinsics(), self.ball_radius, z + self.ball_radius);
            // Of a large ball a quarter of the pixels is enough.
            let weight = if radius > LARGE { 4.0 } else { 1.0 };
            let left_out = radius > LARGE && (u as usize / 4 % 2 == 1 || v as usize / 4 % 2 == 1);
            if left_out || !(2.0..=400.0).contains(&radius) {
                continue;
            }
            let Some(speaks) = blocks.may_be_within([u, v, z], likeness, radius, self.ball_radius) else {
                continue;
            };
            let speaks = weight * speaks;
            let near = spots.iter_mut().find(|spot| {
                let [a, b, c] = spot.mean();
                (c - z).abs() < self.ball_radius && (a - u).powi(2) + (b - v).powi(2) < radius * radius
            });
            match near {
                Some(spot) => {
                    for (sum, x) in spot.sums.iter_mut().zip([u, v, z]) {
                        *sum += x * speaks;
                    }
                    spot.count += speaks;
                }
                None => spots.push(Spot { sums: [u, v, z].map(|x| x * speaks), count: speaks }),
            }
        }
        // How much of a ball's middle speaks for it.
        let share = |spot: &Spot| spot.count * spot.mean()[2].powi(2);
        spots.sort_by(|a, b| share(b).total_cmp(&share(a)));
        let fitted = spots.iter().take(MOST_SPOTS).filter_map(|spot| self.fit(spot.mean()));
        let mut spheres: Vec<(Point3<f64>, f64)> =
            fitted.map(|(centre, filled)| (centre, filled * self.ends(&centre))).collect();
        spheres.sort_by(|a, b| b.1.total_cmp(&a.1));
        spheres.into_iter().filter(|(_, quality)| *quality > HOPELESS).map(|(centre, _)| centre).collect()
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
        let ends = (0..2 * DIRECTIONS).filter(|&i| {
            let (sin, cos) = (std::f64::consts::PI * i as f64 / DIRECTIONS as f64).sin_cos();
            let beside = self.depth.at(disc.u + reach * cos, disc.v + reach * sin);
            beside.is_none_or(|o| o > centre.z || o < centre.z - 2.5 * self.ball_radius)
        });
        ends.count() as f64 / (2 * DIRECTIONS) as f64
    }

    /// The depth about the middle of a coarse pixel: that of the first of five pixels that has any.
    fn about(&self, u: f64, v: f64) -> Option<f64> {
        let places = [(0.5, 0.5), (-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)];
        places.iter().find_map(|(du, dv)| self.depth.at(u + du, v + dv))
    }

    /// The centre (camera axes, metres) of the sphere of the ball's radius that fits the coloured depth around a pixel
    /// with depth: least squares of the points' distances from it, far ones cut off. With it goes how much of the ball's
    /// disc is on that sphere, 0 to 1.
    fn fit(&self, [u, v, z]: [f64; 3]) -> Option<(Point3<f64>, f64)> {
        let (lens, ball) = (self.picture.intrinsics(), self.ball_radius);
        let radius = radius_at(lens, ball, z + ball);
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

    /// What has depth and the ball's colour around where a centre is seen, as points in camera axes.
    fn points(&self, centre: &Point3<f64>, radius: f64) -> Vec<Point3<f64>> {
        let lens = self.picture.intrinsics();
        let Some((u, v)) = lens.project(centre) else { return Vec::new() };
        let step = (2.0 * radius / GRID).max(1.0);
        let reach = (1.15 * radius / step).ceil() as i32;
        let mut points = Vec::new();
        for j in -reach..=reach {
            for i in -reach..=reach {
                let (x, y) = ((u + f64::from(i) * step).round(), (v + f64::from(j) * step).round());
                if (x - u).powi(2) + (y - v).powi(2) > (1.15 * radius).powi(2) {
                    continue;
                }
                let Some(z) = self.depth.at(x, y) else { continue };
                if (z - centre.z).abs() < 1.6 * self.ball_radius && self.picture.likeness(x, y) >= COLOURED {
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
    Some(Disc { u, v, radius: radius_at(picture.intrinsics(), ball_radius, centre.z) })
}
