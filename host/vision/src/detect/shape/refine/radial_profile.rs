//! Radial profile of likeness around a disc.

use multiversion::multiversion;

use super::super::ball_colour::{BallColour, larger};
use super::super::parameters::ProfileParameters;
use super::super::radial_scan::RadialScan;
use super::super::ray_colours::{RAYS, RayColours};
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

/// A number for each sample of each ray, sample by sample.
type Samples = [[f32; RAYS]; SAMPLES];

/// Likeness along the rays from a disc's centre.
struct RadialProfile<'a> {
    parameters: &'a ProfileParameters,
    likeness: Samples,
    /// Drop of likeness outwards at each sample: the mean of `SIDE` samples before it less that of
    /// as many from it on; NaN if one of them is not on the ray or not in the image.
    drops: Samples,
    /// Number of samples of each ray within the image.
    inside: [usize; RAYS],
    /// Drop of a clear edge.
    contrast: f32,
}

impl<'a> RadialProfile<'a> {
    /// Samples the rays of `disc`.
    fn new(view: &'a FrameView, disc: &Disc) -> Self {
        let step = disc.radius / PER_RADIUS as f64;
        let mut colours = [[[0.0; RAYS]; 3]; SAMPLES];
        let scan = RadialScan::new(&view.colour, disc);
        let inside = scan.read_nearest(0.5 * step, step, &mut colours);
        let (mut likeness, mut drops) = ([[0.0; RAYS]; SAMPLES], [[f32::NAN; RAYS]; SAMPLES]);
        read_likeness(&colours, view.colour.ball(), &mut likeness);
        let mut largest = find_drops(&likeness, &inside, &mut drops);
        largest.sort_unstable_by(f32::total_cmp);
        let contrast = largest[RAYS * CONTRAST_DECILE / 10];
        Self { parameters: &view.parameters.profile, likeness, drops, inside, contrast }
    }

    /// Returns the outline of `disc`, whose profile this is.
    fn outline(&self, disc: Disc) -> Outline {
        let ends = PER_RADIUS - END_TOLERANCE..=PER_RADIUS + END_TOLERANCE;
        let end = |ray: usize| {
            // The maximum of numbers and NaN is that of the numbers.
            let drops = self.drops[ends.clone()].iter().map(|drops| drops[ray]);
            match drops.fold(f32::NAN, f32::max) {
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
        let beyond = &self.likeness[start..self.inside[ray].max(start)];
        let least = self.parameters.continued_likeness * self.contrast;
        beyond.iter().map(|sample| sample[ray]).sum::<f32>() > least * beyond.len() as f32
    }
}

/// Writes the likeness of colours to that of the ball.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn read_likeness(colours: &[RayColours; SAMPLES], ball: BallColour, likeness: &mut Samples) {
    for ([blue, green, red], likeness) in colours.iter().zip(likeness) {
        for ray in 0..RAYS {
            likeness[ray] = ball.likeness([blue[ray], green[ray], red[ray]]);
        }
    }
}

/// Writes the drops of likeness on rays with so many samples inside the image. Returns the largest
/// drop on each ray, at least 0. The loops over the rays have no branches, so that the compiler
/// computes many rays at once.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn find_drops(likeness: &Samples, inside: &[usize; RAYS], drops: &mut Samples) -> [f32; RAYS] {
    let mut sums = [[0.0_f32; RAYS]; SAMPLES + 1];
    for (k, likeness) in likeness.iter().enumerate() {
        for ray in 0..RAYS {
            sums[k + 1][ray] = sums[k][ray] + likeness[ray];
        }
    }
    let inside = inside.map(|count| count as i32);
    let mut largest = [0.0_f32; RAYS];
    for k in SIDE..=SAMPLES - SIDE {
        for ray in 0..RAYS {
            let drop =
                (2.0 * sums[k][ray] - sums[k - SIDE][ray] - sums[k + SIDE][ray]) / SIDE as f32;
            let is_inside = (k + SIDE) as i32 <= inside[ray];
            drops[k][ray] = if is_inside { drop } else { f32::NAN };
            largest[ray] = if is_inside { larger(largest[ray], drop) } else { largest[ray] };
        }
    }
    largest
}
