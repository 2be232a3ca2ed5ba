//! Radial profile of likeness around a disc, and the disc fitted to its drops.

use nalgebra::Vector3;

use super::super::parameters::ProfileParameters;
use super::super::radial_scan::{Direction, RAYS, RadialScan, directions};
use super::super::robust_fit::TukeyStep;
use super::super::view::{Disc, FrameView};

/// Samples of a ray in the disc's radius.
const PER_RADIUS: usize = 14;
/// Samples of a ray.
const SAMPLES: usize = 25;
/// Samples on either side of an edge that are compared.
const SIDE: usize = 4;
/// Samples by which an edge may be off the end of the disc.
const END_TOLERANCE: usize = 2;
/// The contrast of a clear edge is this decile of the rays' largest drops.
const CONTRAST_DECILE: usize = 7;
/// Least contrast that drops are divided by.
const MIN_CONTRAST: f64 = 1e-3;

/// What a ray shows where the disc ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayEnd {
    /// The ray leaves the image before.
    OutsideImage,
    /// No edge: the ball's colour continues beyond.
    BallColoured,
    /// No edge, and another colour beyond: an object in front hides the edge.
    NoEdge,
    /// The likeness drops.
    Edge,
}

/// The radial profile of a disc, ray by ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Outline {
    pub(in super::super) disc: Disc,
    /// What each ray shows at the end of the disc.
    pub(in super::super) ends: [RayEnd; RAYS],
    /// Drop of likeness at a clear edge, 0 to 1.
    pub(in super::super) contrast: f64,
}

impl Outline {
    /// Reads the outline of `disc`.
    pub(in super::super) fn new(view: &FrameView, disc: Disc) -> Self {
        RadialProfile::new(view, &disc).outline(disc)
    }

    /// Returns the part of the rays with an edge, of those within the image (a quarter of all rays
    /// at least).
    fn support(&self) -> f64 {
        let count = |end: RayEnd| self.ends.iter().filter(|&&e| e == end).count() as f64;
        let visible = RAYS as f64 - count(RayEnd::OutsideImage);
        count(RayEnd::Edge) / visible.max(RAYS as f64 / 4.0)
    }
}

/// Fits the disc near `start` whose edge matches best; `None` if there is hardly an edge.
///
/// With `free_radius` the radius is searched for first; otherwise it is held near that of `start`,
/// which is known from depth.
pub(in super::super) fn fit_profile(
    view: &FrameView,
    start: &Disc,
    free_radius: bool,
) -> Option<Outline> {
    let parameters = &view.parameters.profile;
    let mut disc = *start;
    let mut profile = RadialProfile::new(view, &disc);
    if free_radius {
        disc.radius = profile.best_radius();
        profile = RadialProfile::new(view, &disc);
    }
    let prior = (!free_radius).then_some(start.radius);
    let min_support =
        if free_radius { parameters.min_support_free } else { parameters.min_support };
    for width in parameters.widths {
        disc = fit_step(view, &disc, &profile, width, prior);
        profile = RadialProfile::new(view, &disc);
        if profile.outline(disc).support() < min_support {
            return None;
        }
    }
    Some(profile.outline(disc))
}

/// Fits the disc to the edges within about `width` radii of it, with the radius drawn to `prior` if
/// it is known.
fn fit_step(
    view: &FrameView,
    disc: &Disc,
    profile: &RadialProfile,
    width: f64,
    prior: Option<f64>,
) -> Disc {
    let parameters = &view.parameters.profile;
    let contrast = f64::from(profile.contrast).max(MIN_CONTRAST);
    let weights = profile.distance_weights(disc.radius, width * disc.radius);
    let cutoff = parameters.cutoff * width * disc.radius;
    let mut fit = TukeyStep::new(cutoff, parameters.damping);
    for (ray, &Direction { cos, sin }) in directions().iter().enumerate() {
        let Some(edge) = profile.edge(ray, &weights) else { continue };
        let clearness = (edge.drop / contrast).clamp(0.0, 1.0).powi(2);
        fit.add(Vector3::new(cos, sin, 1.0), edge.at - disc.radius, clearness);
    }
    if let Some(radius) = prior {
        fit.add_prior(radius - disc.radius, parameters.radius_prior);
    }
    let Some(solution) = fit.solve() else { return *disc };
    RadialScan::new(&view.colour, disc).moved(disc.radius, &solution.step)
}

/// Likeness along the rays from a disc's centre.
struct RadialProfile<'a> {
    parameters: &'a ProfileParameters,
    likeness: [[f32; SAMPLES]; RAYS],
    /// Drop of likeness outwards at each sample of each ray: the mean of `SIDE` samples before it
    /// less that of as many from it on; NaN if one of them is not on the ray or not in the image.
    drops: [[f32; SAMPLES]; RAYS],
    /// Number of samples of each ray within the image.
    inside: [usize; RAYS],
    /// Pixels between samples.
    step: f64,
    /// Drop of a clear edge.
    contrast: f32,
}

/// The drop of likeness at a place on a ray.
#[derive(Clone, Copy)]
struct Drop {
    /// Pixels from the centre.
    at: f64,
    drop: f64,
}

impl<'a> RadialProfile<'a> {
    /// Samples the rays of `disc`.
    fn new(view: &'a FrameView, disc: &Disc) -> Self {
        let step = disc.radius / PER_RADIUS as f64;
        let mut profile = Self {
            parameters: &view.parameters.profile,
            likeness: [[0.0; SAMPLES]; RAYS],
            drops: [[f32::NAN; SAMPLES]; RAYS],
            inside: [0; RAYS],
            step,
            contrast: 0.0,
        };
        let scan = RadialScan::new(&view.colour, disc);
        let ball = view.colour.ball();
        let mut colours = [[0.0; 3]; SAMPLES];
        for ray in 0..RAYS {
            let inside = scan.read_nearest(ray, 0.5 * step, step, &mut colours);
            profile.inside[ray] = inside;
            for (likeness, colour) in profile.likeness[ray].iter_mut().zip(&colours[..inside]) {
                *likeness = ball.likeness(*colour);
            }
        }
        profile.find_drops();
        profile
    }

    /// Computes the drops and the contrast of a clear edge.
    fn find_drops(&mut self) {
        let mut largest = [0.0_f32; RAYS];
        for (ray, largest) in largest.iter_mut().enumerate() {
            let mut sums = [0.0_f32; SAMPLES + 1];
            for (k, likeness) in self.likeness[ray].iter().enumerate() {
                sums[k + 1] = sums[k] + likeness;
            }
            for k in SIDE..=self.inside[ray].saturating_sub(SIDE) {
                let drop = (2.0 * sums[k] - sums[k - SIDE] - sums[k + SIDE]) / SIDE as f32;
                self.drops[ray][k] = drop;
                *largest = f32::max(*largest, drop);
            }
        }
        largest.sort_by(f32::total_cmp);
        self.contrast = largest[RAYS * CONTRAST_DECILE / 10];
    }

    /// Returns the weight of an edge at each sample if it is expected at `radius` pixels: a
    /// Gaussian with the standard deviation `width`, pixels.
    fn distance_weights(&self, radius: f64, width: f64) -> [f32; SAMPLES] {
        std::array::from_fn(|k| {
            let distance = (k as f64 * self.step - radius) / width;
            (-distance * distance / 2.0).exp() as f32
        })
    }

    /// Returns the largest weighted drop of a ray, between samples.
    fn edge(&self, ray: usize, weights: &[f32; SAMPLES]) -> Option<Drop> {
        let drops = &self.drops[ray];
        let (mut best, mut k) = (0.0_f32, 0);
        for (i, (drop, weight)) in drops.iter().zip(weights).enumerate() {
            // The comparison is false for NaN.
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
        // The peak of the parabola through the three drops.
        let bend = before - 2.0 * drop + after;
        let shift =
            if bend < -1e-6 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        Some(Drop { at: (k as f64 + shift) * self.step, drop })
    }

    /// Returns the radius, pixels, at which most rays have an edge. A drop counts up to the
    /// contrast of a clear edge.
    fn best_radius(&self) -> f64 {
        let limit = self.contrast;
        let sum = |k: usize| -> f32 {
            let drops = self.drops.iter().map(|drops| drops[k]).filter(|drop| !drop.is_nan());
            drops.map(|drop| drop.clamp(-limit, limit)).sum()
        };
        let sums = (SIDE..=SAMPLES - SIDE).map(|k| (k, sum(k)));
        let best = sums.max_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(PER_RADIUS as f64, |(k, _)| k as f64) * self.step
    }

    /// Returns the outline of `disc`, whose profile this is.
    fn outline(&self, disc: Disc) -> Outline {
        let ends = PER_RADIUS - END_TOLERANCE..=PER_RADIUS + END_TOLERANCE;
        let end = |ray: usize| {
            // The maximum of numbers and NaN is that of the numbers.
            match self.drops[ray][ends.clone()].iter().copied().fold(f32::NAN, f32::max) {
                drop if drop.is_nan() => RayEnd::OutsideImage,
                drop if drop > self.parameters.clear_drop * self.contrast => RayEnd::Edge,
                _ if self.is_ball_coloured_beyond(ray) => RayEnd::BallColoured,
                _ => RayEnd::NoEdge,
            }
        };
        Outline { disc, ends: std::array::from_fn(end), contrast: f64::from(self.contrast) }
    }

    /// Checks whether the ball's colour continues on a ray beyond the disc.
    fn is_ball_coloured_beyond(&self, ray: usize) -> bool {
        let start = PER_RADIUS + END_TOLERANCE;
        let beyond = &self.likeness[ray][start..self.inside[ray].max(start)];
        let least = self.parameters.continued_likeness * self.contrast;
        beyond.iter().sum::<f32>() > least * beyond.len() as f32
    }
}
