//! The search of a window: proposals are refined and decided about until one is certain.

use super::decide::Decider;
use super::downsampled::{LikenessMap, Window};
use super::parameters::SearchParameters;
use super::propose::{Seed, SeedSelector, find_spheres, sphere_at};
use super::refine::{fit_profile, refine};
use super::trace::{CandidateTrace, SearchTrace};
use super::view::{Disc, FrameView};

/// A search in progress.
struct Search<'a> {
    view: &'a FrameView<'a>,
    parameters: &'a SearchParameters,
    decider: Decider<'a>,
    trace: SearchTrace,
}

/// Searches the `window` of a frame that `likeness` was made of.
pub(super) fn search(view: &FrameView, window: Window, likeness: LikenessMap) -> SearchTrace {
    let trace = SearchTrace {
        window,
        likeness,
        spheres: Vec::new(),
        blobs: Vec::new(),
        seeds: Vec::new(),
        candidates: Vec::new(),
        best: None,
    };
    let parameters = &view.parameters.search;
    let mut search = Search { view, parameters, decider: Decider::new(view), trace };
    if !search.try_spheres() {
        search.try_blobs();
    }
    search.trace
}

impl Search<'_> {
    /// Tries the spheres in depth. Returns whether one of them is certain.
    fn try_spheres(&mut self) -> bool {
        let spheres = find_spheres(self.view, &self.trace.likeness);
        self.trace.spheres =
            spheres.iter().filter_map(|centre| self.view.disc_of(centre)).collect();
        let mut left = self.parameters.max_depth_seeds;
        for i in 0..self.trace.spheres.len() {
            let disc = self.trace.spheres[i];
            if left == 0 {
                break;
            }
            if self.decider.passes(&disc) {
                left -= 1;
                if self.consider(&disc, true) {
                    return true;
                }
            }
        }
        false
    }

    /// Tries the blobs of the ball's colour.
    fn try_blobs(&mut self) {
        let selector = SeedSelector::new(self.view);
        self.trace.blobs = selector.blobs(&self.trace.likeness, self.radii());
        let screen = |disc: &Disc| self.decider.passes_blob(disc);
        let seeds = selector.select(&self.trace.blobs, screen);
        self.trace.seeds = seeds.iter().map(|seed| seed.disc).collect();
        for seed in seeds {
            let disc = self.locate(&seed);
            let passing = disc.filter(|disc| self.decider.passes(disc));
            if passing.is_some_and(|disc| self.consider(&disc, false)) {
                break;
            }
        }
    }

    /// Returns the disc of a seed: that of the sphere in depth, or else that of the radial profile.
    fn locate(&self, seed: &Seed) -> Option<Disc> {
        let sphere = seed.surface.and_then(|z| sphere_at(self.view, &seed.disc, z));
        let by_depth = sphere.and_then(|centre| self.view.disc_of(&centre));
        by_depth.or_else(|| {
            let outline = fit_profile(self.view, &seed.disc, seed.surface.is_none());
            outline.map(|outline| outline.disc)
        })
    }

    /// Refines the disc at `start` and decides about it, unless a candidate before it started or
    /// ended there. Returns whether it is certain.
    fn consider(&mut self, start: &Disc, locked: bool) -> bool {
        let known =
            self.trace.candidates.iter().flat_map(|known| [&known.start, &known.circle.disc]);
        if known.into_iter().any(|disc| self.is_same(disc, start)) {
            return false;
        }
        let candidate = refine(self.view, start, locked);
        let best = self.trace.best().map(CandidateTrace::score);
        let least =
            best.map_or(self.parameters.min_score, |best| best.max(self.parameters.min_score));
        let (smallest, largest) = self.radii();
        let margin = self.parameters.radius_margin;
        let range = (1.0 - margin) * smallest..(1.0 + margin) * largest;
        let decision = range
            .contains(&candidate.circle.disc.radius)
            .then(|| self.decider.decide(&candidate, least));
        let (start, circle, ray_ends) = (*start, candidate.circle, candidate.outline.ends);
        let candidate = CandidateTrace { start, circle, ray_ends, decision };
        let score = candidate.score();
        // Of equal scores the first one counts: it was the more promising one.
        if best.is_none_or(|best| score > best) {
            self.trace.best = Some(self.trace.candidates.len());
        }
        self.trace.candidates.push(candidate);
        score > self.parameters.certain_score
    }

    /// Returns the smallest and the largest radius of the ball, pixels.
    fn radii(&self) -> (f64, f64) {
        let SearchParameters { min_distance, max_distance, .. } = *self.parameters;
        (self.view.radius_at(max_distance), self.view.radius_at(min_distance))
    }

    /// Checks whether two discs would be refined to one circle.
    fn is_same(&self, a: &Disc, b: &Disc) -> bool {
        let least = a.radius.min(b.radius);
        a.distance(b) < self.parameters.same_centre * least
            && (a.radius - b.radius).abs() < self.parameters.same_radius * least
    }
}
