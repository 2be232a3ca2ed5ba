//! Seeds: blobs whose size fits their depth.

use std::f64::consts::TAU;

use super::super::downsampled::LikenessMap;
use super::super::parameters::SeedParameters;
use super::super::view::{Disc, FrameView};
use super::blobs::{Proposal, find_blobs};

/// A place where an outline is looked for.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Seed {
    /// The disc. If the depth is known, the radius is that of a ball at this depth.
    pub(in super::super) disc: Disc,
    /// Depth of the surface there, metres; `None` if it is unknown.
    pub(in super::super) surface: Option<f64>,
}

/// Selects the seeds of a frame among its blobs.
pub(in super::super) struct SeedSelector<'a> {
    view: &'a FrameView<'a>,
    parameters: &'a SeedParameters,
}

impl<'a> SeedSelector<'a> {
    /// Selects seeds in `view`.
    pub(in super::super) fn new(view: &'a FrameView<'a>) -> Self {
        Self { view, parameters: &view.parameters.seeds }
    }

    /// Finds the blobs in `map` with a radius within `radii`, pixels, the strongest first.
    pub(in super::super) fn blobs(&self, map: &LikenessMap, radii: (f64, f64)) -> Vec<Proposal> {
        find_blobs(map, radii, &self.view.parameters.blobs)
    }

    /// Returns the seeds of the strongest blobs that pass `screen`.
    pub(in super::super) fn select(
        &self,
        blobs: &[Proposal],
        screen: impl Fn(&Disc) -> bool,
    ) -> Vec<Seed> {
        let mut seeds: Vec<Seed> = Vec::new();
        let mut with_depth = self.parameters.max_with_depth;
        let mut without_depth = self.parameters.max_without_depth;
        let mut left = self.parameters.max_screened;
        for blob in blobs {
            let Some(seed) = self.seed(&blob.disc) else { continue };
            let places = if seed.surface.is_some() { &mut with_depth } else { &mut without_depth };
            let is_known = seeds.iter().any(|known| self.is_same(&known.disc, &seed.disc));
            if *places == 0 || is_known || self.is_attached(&seed) {
                continue;
            }
            left -= 1;
            if screen(&seed.disc) {
                *places -= 1;
                seeds.push(seed);
            }
            if left == 0 {
                break;
            }
        }
        seeds
    }

    /// Makes the seed of a blob; `None` if the ball has another size at the blob's depth.
    fn seed(&self, disc: &Disc) -> Option<Seed> {
        let Some(z) = self.median_depth(disc) else {
            return Some(Seed { disc: *disc, surface: None });
        };
        let radius = self.view.radius_at(z + self.view.ball_radius);
        let factor = (radius / disc.radius).max(disc.radius / radius);
        let fits = factor < self.parameters.max_size_factor;
        fits.then_some(Seed { disc: Disc { radius, ..*disc }, surface: Some(z) })
    }

    /// Returns the median depth, metres, of nine pixels about the middle of `disc`; `None` if too
    /// few have depth.
    fn median_depth(&self, disc: &Disc) -> Option<f64> {
        let mut depths = [0.0; 9];
        let mut n = 0;
        for i in 0..9 {
            let offset = |k: i32| f64::from(k - 1) * self.parameters.depth_spacing * disc.radius;
            if let Some(z) = self.view.depth.at(disc.u + offset(i % 3), disc.v + offset(i / 3)) {
                depths[n] = z;
                n += 1;
            }
        }
        depths[..n].sort_by(f64::total_cmp);
        (n >= self.parameters.min_depths).then(|| depths[n / 2])
    }

    /// Checks whether the surroundings of a seed are mostly as near as the seed: it is a part of a
    /// larger object.
    fn is_attached(&self, seed: &Seed) -> bool {
        let Some(z) = seed.surface else { return false };
        let count = self.parameters.surrounding_places;
        let is_near = |i: u32| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(count)).sin_cos();
            let reach = self.parameters.surroundings * seed.disc.radius;
            let beside = self.view.depth.at(seed.disc.u + reach * cos, seed.disc.v + reach * sin);
            beside.is_some_and(|beside| (beside - z).abs() < self.view.ball_radius)
        };
        (0..count).filter(|&i| is_near(i)).count() > self.parameters.max_attached
    }

    /// Checks whether two seeds would lead to one outline.
    fn is_same(&self, a: &Disc, b: &Disc) -> bool {
        let (small, large) = (a.radius.min(b.radius), a.radius.max(b.radius));
        a.distance(b) < self.parameters.same_centre * small
            && large < self.parameters.same_radius_factor * small
    }
}
