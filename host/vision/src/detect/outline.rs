//! A ball's outline: looked for along rays from its middle and fitted.

use nalgebra::{Matrix3, Vector3};

use super::picture::{Disc, Picture};
use super::rays::RAYS;

/// Samples on a ray in the ball's radius.
const PER_RADIUS: f64 = 14.0;
/// Samples on a ray.
const SAMPLES: usize = 25;
/// Samples on either side of an edge that are compared.
const SIDE: usize = 4;
/// How far from the last disc edges are believed, step by step, in its radius.
const WIDTHS: [f64; 3] = [0.3, 0.2, 0.12];
/// How many clear edges a radius that is known from depth counts for.
const PRIOR: f64 = 12.0;
/// Less support than this after a step will not become a ball.
const HOPELESS: f64 = 0.3;
/// The same where nothing but its outline speaks for it.
const HOPELESS_FREE: f64 = 0.5;
/// Part of the usual contrast that a drop of redness must have to be an edge.
const CLEAR: f32 = 0.4;

/// What a ray shows where the disc ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rim {
    /// It leaves the picture before.
    Unseen,
    /// No edge, and red beyond.
    Red,
    /// No edge, and not red beyond: something in front of the disc hides it.
    Plain,
    /// Redness drops.
    Edge,
}

/// What was seen around a fitted disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Outline {
    /// The disc.
    pub(super) disc: Disc,
    /// What each ray shows at its end.
    pub(super) rims: [Rim; RAYS],
    /// Drop of redness at the edge, 0 to 1.
    pub(super) contrast: f64,
}

impl Outline {
    /// Part of the rays with an edge (of those within the picture, which are taken to be a quarter
    /// at least).
    pub(super) fn support(&self) -> f64 {
        let count = |rim: Rim| self.rims.iter().filter(|&&r| r == rim).count() as f64;
        count(Rim::Edge) / (RAYS as f64 - count(Rim::Unseen)).max(RAYS as f64 / 4.0)
    }
}

/// Redness along the rays from a disc's middle.
struct Polar {
    /// Redness on each ray.
    red: [[f32; SAMPLES]; RAYS],
    /// Drop of redness outwards at each sample of each ray: the mean of `SIDE` samples before it
    /// less that of as many from it on; NaN where those are not all on the ray and within the
    /// picture.
    drops: [[f32; SAMPLES]; RAYS],
    /// Samples of each ray within the picture.
    inside: [usize; RAYS],
    /// Pixels between samples.
    step: f64,
    /// The drop that a clear edge has here: of the rays' largest ones the seventh of ten.
    contrast: f32,
}

/// The drop of redness at a place on a ray.
#[derive(Clone, Copy)]
struct Edge {
    /// Pixels from the middle.
    at: f64,
    drop: f64,
}

impl Picture<'_> {
    /// The disc near `start` whose edge fits best; `None` where it soon shows that there is none.
    /// `free` lets its radius be looked for at first; otherwise it is held near that of `start`,
    /// which depth has said.
    pub(super) fn fit(&self, start: Disc, free: bool) -> Option<Outline> {
        let mut disc = start;
        let mut polar = self.polar(&disc);
        if free {
            disc.radius = polar.best_radius();
            polar = self.polar(&disc);
        }
        let prior = (!free).then_some(start.radius);
        for width in WIDTHS {
            disc = self.refine(&disc, &polar, width, prior);
            polar = self.polar(&disc);
            if polar.outline(disc).support() < if free { HOPELESS_FREE } else { HOPELESS } {
                return None;
            }
        }
        Some(polar.outline(disc))
    }

    /// What is seen around `disc`.
    pub(super) fn outline_at(&self, disc: Disc) -> Outline {
        self.polar(&disc).outline(disc)
    }

    fn polar(&self, disc: &Disc) -> Polar {
        let step = disc.radius / PER_RADIUS;
        let (red, drops) = ([[0.0; SAMPLES]; RAYS], [[f32::NAN; SAMPLES]; RAYS]);
        let mut polar = Polar { red, drops, inside: [0; RAYS], step, contrast: 0.0 };
        let rays = self.rays(disc);
        let mut colours = [[0.0; 3]; SAMPLES];
        for (ray, (red, inside)) in polar.red.iter_mut().zip(&mut polar.inside).enumerate() {
            *inside = rays.colours(ray, 0.5 * step, step, &mut colours);
            for (red, colour) in red.iter_mut().zip(&colours[..*inside]) {
                *red = self.ball().of(*colour);
            }
        }
        polar.find_drops();
        polar
    }

    /// One step of the fit: the disc through the edges within about `width` radii of this one
    /// (weighted least squares, outliers cut off as by Tukey), with the radius drawn to `prior`
    /// where there is one.
    fn refine(&self, disc: &Disc, polar: &Polar, width: f64, prior: Option<f64>) -> Disc {
        let contrast = f64::from(polar.contrast).max(1e-3);
        let near = polar.weights(disc.radius, width * disc.radius);
        let (mut normal, mut right_side) = (Matrix3::zeros(), Vector3::zeros());
        for (ray, &(cos, sin)) in self.directions().iter().enumerate() {
            let Some(edge) = polar.edge(ray, &near) else { continue };
            let residual = edge.at - disc.radius;
            let off = (residual / (2.0 * width * disc.radius)).clamp(-1.0, 1.0);
            let weight = (edge.drop / contrast).clamp(0.0, 1.0).powi(2) * (1.0 - off * off).powi(2);
            let row = Vector3::new(cos, sin, 1.0);
            normal += row * row.transpose() * weight;
            right_side += row * residual * weight;
        }
        // Few edges must not move the disc far.
        normal += Matrix3::identity();
        if let Some(radius) = prior {
            normal[(2, 2)] += PRIOR;
            right_side.z += (radius - disc.radius) * PRIOR;
        }
        let Some(step) = normal.cholesky().map(|c| c.solve(&right_side)) else { return *disc };
        self.rays(disc).moved(disc.radius, &step)
    }
}

impl Polar {
    fn find_drops(&mut self) {
        let mut largest = [0.0_f32; RAYS];
        for (ray, largest) in largest.iter_mut().enumerate() {
            let mut sums = [0.0_f32; SAMPLES + 1];
            for (k, red) in self.red[ray].iter().enumerate() {
                sums[k + 1] = sums[k] + red;
            }
            for k in SIDE..=self.inside[ray].saturating_sub(SIDE) {
                let drop = (2.0 * sums[k] - sums[k - SIDE] - sums[k + SIDE]) / SIDE as f32;
                self.drops[ray][k] = drop;
                *largest = f32::max(*largest, drop);
            }
        }
        largest.sort_by(f32::total_cmp);
        self.contrast = largest[RAYS * 7 / 10];
    }

    /// How much an edge at each sample is believed when one is expected at `radius` pixels: a
    /// Gaussian of `width`.
    fn weights(&self, radius: f64, width: f64) -> [f32; SAMPLES] {
        std::array::from_fn(|k| {
            let off = (k as f64 * self.step - radius) / width;
            (-off * off / 2.0).exp() as f32
        })
    }

    /// The largest drop of a ray, weighted by `weights`.
    fn edge(&self, ray: usize, weights: &[f32; SAMPLES]) -> Option<Edge> {
        let drops = &self.drops[ray];
        let (mut best, mut k) = (0.0_f32, 0);
        for (i, (drop, weight)) in drops.iter().zip(weights).enumerate() {
            // Not true of NaN.
            if drop * weight > best {
                (best, k) = (drop * weight, i);
            }
        }
        if k == 0 {
            return None;
        }
        let at = |k: usize| drops.get(k).copied().filter(|d| !d.is_nan()).map(f64::from);
        let drop = at(k)?;
        let (before, after) = (at(k - 1).unwrap_or(drop), at(k + 1).unwrap_or(drop));
        let bend = before - 2.0 * drop + after;
        let shift =
            if bend < -1e-6 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        Some(Edge { at: (k as f64 + shift) * self.step, drop })
    }

    /// The radius at which most rays have an edge (drops above the usual contrast count no more
    /// than it).
    fn best_radius(&self) -> f64 {
        let limit = self.contrast;
        let at = |k: usize| -> f32 {
            self.drops
                .iter()
                .map(|d| d[k])
                .filter(|d| !d.is_nan())
                .map(|d| d.clamp(-limit, limit))
                .sum()
        };
        let best = (SIDE..=SAMPLES - SIDE).map(|k| (k, at(k))).max_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(PER_RADIUS, |b| b.0 as f64) * self.step
    }

    /// What is seen around `disc`, which this was sampled for.
    fn outline(&self, disc: Disc) -> Outline {
        let end = PER_RADIUS as usize;
        let rim = |ray: usize| {
            // The maximum of numbers and NaN is that of the numbers.
            match self.drops[ray][end - 2..=end + 2].iter().copied().fold(f32::NAN, f32::max) {
                drop if drop.is_nan() => Rim::Unseen,
                drop if drop > CLEAR * self.contrast => Rim::Edge,
                _ if self.is_red_beyond(ray) => Rim::Red,
                _ => Rim::Plain,
            }
        };
        Outline { disc, rims: std::array::from_fn(rim), contrast: f64::from(self.contrast) }
    }

    /// Whether a ray beyond the disc is as red as the disc, more or less.
    fn is_red_beyond(&self, ray: usize) -> bool {
        let beyond =
            &self.red[ray][PER_RADIUS as usize + 2..self.inside[ray].max(PER_RADIUS as usize + 2)];
        beyond.iter().sum::<f32>() > 0.5 * self.contrast * beyond.len() as f32
    }
}
