//! Radial profile of likeness around a disc.

use super::super::parameters::ProfileParameters;
use super::super::radial_scan::{RAYS, RadialScan};
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
}

impl Outline {
    /// Reads the outline of `disc`.
    pub(in super::super) fn new(view: &FrameView, disc: Disc) -> Self {
        RadialProfile::new(view, &disc).outline(disc)
    }
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
    /// Drop of a clear edge.
    contrast: f32,
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
        Outline { disc, ends: std::array::from_fn(end) }
    }

    /// Checks whether the ball's colour continues on a ray beyond the disc.
    fn is_ball_coloured_beyond(&self, ray: usize) -> bool {
        let start = PER_RADIUS + END_TOLERANCE;
        let beyond = &self.likeness[ray][start..self.inside[ray].max(start)];
        let least = self.parameters.continued_likeness * self.contrast;
        beyond.iter().sum::<f32>() > least * beyond.len() as f32
    }
}
