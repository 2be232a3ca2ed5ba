//! Irradiance in a room: ambient light with occlusion, area lights with soft shadows, smoothing.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use super::{Pixel, RayCaster};
use crate::synthetic::room::AreaLight;
use crate::synthetic::room::shape::{Ray, wall};

/// Distance within which objects occlude ambient light, metres.
const OCCLUSION_DISTANCE: f64 = 0.5;

impl RayCaster<'_> {
    /// Returns whether an object occludes `ray` before `t` = `end`.
    pub(super) fn is_occluded(&self, ray: &Ray, end: f64) -> bool {
        self.candidates(ray, ray.along.norm(), end).any(|(_, object)| {
            object.glow <= 0.0 && object.shape.intersect(ray).is_some_and(|at| at.t < end)
        })
    }

    /// Returns the ambient visibility at `from`: 1 in the open, less in corners and under objects.
    pub(super) fn ambient_visibility(
        &self,
        from: &Point3<f64>,
        normal: &Vector3<f64>,
        random: &impl Fn(i64) -> f64,
    ) -> f64 {
        let mut open = 0.0;
        for sample in 0..3 {
            let z = 2.0 * random(2 * sample) - 1.0;
            let (sin, cos) = (std::f64::consts::TAU * random(2 * sample + 1)).sin_cos();
            let flat = (1.0 - z * z).max(0.0).sqrt();
            // A random point on a sphere that touches the surface gives a cosine-weighted
            // direction.
            let along = normal + Vector3::new(flat * cos, flat * sin, z);
            let ray = Ray { from: *from, along: along.try_normalize(1e-9).unwrap_or(*normal) };
            let free = (wall(&ray, &self.low, &self.high).t / OCCLUSION_DISTANCE).min(1.0);
            open +=
                if self.is_occluded(&ray, OCCLUSION_DISTANCE) { 0.15 } else { 0.35 + 0.65 * free };
        }
        // More ambient light comes from above than from below.
        open / 3.0 * (0.85 + 0.15 * normal.z)
    }

    /// Returns the share of the light of `panel` that arrives at `from` from its point at `place`
    /// (0 to 1 along both edges).
    pub(super) fn panel(
        &self,
        panel: &AreaLight,
        from: &Point3<f64>,
        normal: &Vector3<f64>,
        place: [f64; 2],
    ) -> f64 {
        let source =
            panel.centre + panel.a * (2.0 * place[0] - 1.0) + panel.b * (2.0 * place[1] - 1.0);
        let to = source - from;
        let distance = to.norm();
        let out = panel.a.cross(&panel.b).try_normalize(1e-12).unwrap_or_else(Vector3::z);
        let facing = normal.dot(&to) / distance;
        let leaving = -out.dot(&to) / distance;
        if facing <= 0.0
            || leaving <= 0.0
            || self.is_occluded(&Ray { from: *from, along: to }, 0.995)
        {
            return 0.0;
        }
        // The light falls off more slowly than 1/d², as walls reflect it.
        facing * (0.3 + 0.7 * leaving) / (1.0 + distance * distance)
    }
}

/// What smoothing needs of the pixels, each value in an array of its own, so that the compiler
/// smooths several columns at once.
pub(super) struct Light {
    surface: Vec<u32>,
    normal: [Vec<f32>; 3],
    arriving: [Vec<f32>; 3],
}

/// Largest distance of neighbours that are smoothed, pixels along each axis.
const REACH: usize = 4;

impl Light {
    pub(super) fn of(pixels: &[Pixel]) -> Self {
        let surface = pixels.iter().map(|pixel| pixel.hit.surface as u32).collect();
        let normal = |k: usize| pixels.iter().map(|pixel| pixel.hit.at.normal[k] as f32).collect();
        let arriving = |k: usize| pixels.iter().map(|pixel| pixel.arriving[k]).collect();
        Self { surface, normal: [0, 1, 2].map(normal), arriving: [0, 1, 2].map(arriving) }
    }

    /// Returns the mean irradiance of the neighbours on the same surface, for each pixel of `row`.
    pub(super) fn smoothed(&self, row: usize, (width, height): (usize, usize)) -> Vec<[f32; 3]> {
        let zeros = || vec![0.0; width];
        let mut sums = Sums { counts: zeros(), arriving: [zeros(), zeros(), zeros()] };
        for other in row.saturating_sub(REACH)..(row + REACH + 1).min(height) {
            for shift in 0..=2 * REACH {
                // Of column `own`, the neighbour in column `own + shift - REACH`.
                let first = REACH.saturating_sub(shift);
                let count = width.saturating_sub(shift.abs_diff(REACH));
                let (own, other) = (row * width + first, other * width + first + shift - REACH);
                self.add(own, other, &mut sums, first..first + count);
            }
        }
        let mean = |column: usize| {
            let count = f32::max(sums.counts[column], 1.0);
            sums.arriving.each_ref().map(|it| it[column] / count)
        };
        (0..width).map(mean).collect()
    }

    /// Adds to the sums of `columns` the irradiance of the pixels from `other` on, where the pixels
    /// from `own` on are on the same surface with similar normals.
    fn add(&self, own: usize, other: usize, sums: &mut Sums, columns: Range<usize>) {
        // Slices of one length, of which the compiler sees that it is the same.
        let count = columns.len();
        let [ax, ay, az] = self.normal.each_ref().map(|it| &it[own..][..count]);
        let [bx, by, bz] = self.normal.each_ref().map(|it| &it[other..][..count]);
        let [a0, a1, a2] = self.arriving.each_ref().map(|it| &it[other..][..count]);
        let [s0, s1, s2] = sums.arriving.each_mut().map(|it| &mut it[columns.start..][..count]);
        let (a, b) = (&self.surface[own..][..count], &self.surface[other..][..count]);
        let counts = &mut sums.counts[columns.start..][..count];
        for k in 0..count {
            let dot = ax[k] * bx[k] + ay[k] * by[k] + az[k] * bz[k];
            let is_like = (a[k] == b[k]) & (dot > 0.93);
            counts[k] += if is_like { 1.0 } else { 0.0 };
            s0[k] += if is_like { a0[k] } else { 0.0 };
            s1[k] += if is_like { a1[k] } else { 0.0 };
            s2[k] += if is_like { a2[k] } else { 0.0 };
        }
    }
}

/// Sums over neighbours, for each pixel of a row.
struct Sums {
    counts: Vec<f32>,
    arriving: [Vec<f32>; 3],
}
