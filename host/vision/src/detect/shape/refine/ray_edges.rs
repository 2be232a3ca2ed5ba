//! The edges on the rays of a disc, to a fraction of a pixel.
//!
//! Near its edge a pixel mixes the ball's colour and the background's, and the edge is where the
//! mixture is half of each. Both colours are read on each ray, inside and outside. So shading,
//! highlights, exposure and background do not shift the edge. Blur and motion spread the mixture
//! evenly to both sides and do not shift it either.
//!
//! All rays are computed at once: the arrays have a number for each of them, and the processor adds
//! many numbers in one step.

use std::array;
use std::f64::consts::PI;

use multiversion::multiversion;

use super::super::radial_scan::RadialScan;
use super::super::ray_colours::{RAYS, RayColours};
use super::super::view::{ColourView, Disc};

/// Samples on a ray to either side of the expected edge.
const HALF: usize = 12;
/// Samples on a ray.
const SAMPLES: usize = 2 * HALF + 1;
/// Samples at either end of a ray that give the colours inside and outside.
const END: usize = HALF / 2;

/// The edge on a ray.
#[derive(Clone, Copy)]
pub(in super::super) struct Edge {
    /// Pixels outwards from the disc.
    pub(in super::super) residual: f64,
    /// 0 to 1: by how much both colours differ, against their own unevenness.
    pub(in super::super) weight: f64,
    /// Standard deviation of its blur, pixels.
    pub(in super::super) blur: f64,
}

/// The edges on all rays; `None` where there is none.
pub(in super::super) type Edges = [Option<Edge>; RAYS];

/// Returns the edge of each trusted ray within its band, pixels. A difference of `faint` grey
/// levels has half the full weight.
pub(in super::super) fn read_edges(
    (image, faint): (&ColourView, f32),
    disc: &Disc,
    bands: &[f64; RAYS],
    trusted: &[bool; RAYS],
) -> Edges {
    let scan = RadialScan::new(image, disc);
    let (starts, steps) = (bands.map(|band| disc.radius - band), bands.map(|b| b / HALF as f64));
    let mut samples = [[[0.0; RAYS]; 3]; SAMPLES];
    let inside = scan.read_bilinear(&starts, &steps, &mut samples);
    let mixtures = Mixtures::new(&samples, faint);
    array::from_fn(|ray| {
        (trusted[ray] && inside[ray]).then(|| mixtures.edge(ray, steps[ray])).flatten()
    })
}

/// How the ball's colour changes to the background's along each ray.
struct Mixtures {
    /// Square of the difference of both colours, grey levels².
    squared: [f32; RAYS],
    /// Square of the differences that the colours have by themselves, grey levels².
    noise: [f32; RAYS],
    /// The sample before the most likely place of the edge.
    before: [f32; RAYS],
    /// The part of the ball, less a half, in that sample and in the one after it.
    parts: [[f32; RAYS]; 2],
    /// Sum of p (1 - p) for the part p of the ball in each sample.
    mixed: [f32; RAYS],
}

impl Mixtures {
    /// Finds the mixture on each ray.
    fn new(samples: &[RayColours; SAMPLES], faint: f32) -> Self {
        let zeros = [0.0; RAYS];
        let mut mixtures =
            Self { squared: zeros, noise: zeros, before: zeros, parts: [zeros; 2], mixed: zeros };
        find_mixtures(samples, faint, &mut mixtures);
        mixtures
    }

    /// Returns the edge on a ray whose samples are `step` pixels apart.
    fn edge(&self, ray: usize, step: f64) -> Option<Edge> {
        let [inner, outer] = self.parts.map(|part| part[ray]);
        let squared = self.squared[ray];
        if squared < 1.0 || inner < 0.0 || outer > 0.0 || inner - outer < 1e-6 {
            return None;
        }
        let place = f64::from(self.before[ray]) + f64::from(inner / (inner - outer));
        // For a Gaussian edge the integral of p (1 - p) is its standard deviation over √π.
        let blur = f64::from(self.mixed[ray]) * step * PI.sqrt();
        let weight = f64::from(squared / (squared + self.noise[ray]));
        Some(Edge { residual: (place - HALF as f64) * step, weight, blur })
    }
}

/// Finds the mixture on each ray; all numbers of `mixtures` are 0 before. The loops over the rays
/// have no branches, so that the compiler computes many rays at once.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn find_mixtures(samples: &[RayColours; SAMPLES], faint: f32, mixtures: &mut Mixtures) {
    let Mixtures { squared, noise, before, parts: [inner_part, outer_part], mixed } = mixtures;
    let (inner, outer) = (side(&samples[..END]), side(&samples[SAMPLES - END..]));
    let mut change = [[0.0; RAYS]; 3];
    for (c, change) in change.iter_mut().enumerate() {
        for ray in 0..RAYS {
            change[ray] = inner.mean[c][ray] - outer.mean[c][ray];
            squared[ray] += change[ray] * change[ray];
        }
    }
    let variances = inner.variance.iter().zip(&outer.variance);
    for (noise, (inner, outer)) in noise.iter_mut().zip(variances) {
        *noise = 4.0 * (inner + outer) + faint * faint;
    }
    // The most likely place of a step between both levels: as much of the ball before it as
    // possible, as much of the background beyond.
    let (mut sum, mut most) = ([0.0; RAYS], [f32::NEG_INFINITY; RAYS]);
    let mut is_after = [false; RAYS];
    for (k, colours) in samples.iter().enumerate() {
        for ray in 0..RAYS {
            let mut product = 0.0;
            for c in 0..3 {
                product += (colours[c][ray] - outer.mean[c][ray]) * change[c][ray];
            }
            let part = product / squared[ray] - 0.5;
            let clamped = part.clamp(-0.5, 0.5);
            mixed[ray] += 0.25 - clamped * clamped;
            outer_part[ray] = if is_after[ray] { part } else { outer_part[ray] };
            sum[ray] += clamped;
            let is_most = sum[ray] > most[ray] && k < SAMPLES - 1;
            most[ray] = if is_most { sum[ray] } else { most[ray] };
            before[ray] = if is_most { k as f32 } else { before[ray] };
            inner_part[ray] = if is_most { part } else { inner_part[ray] };
            is_after[ray] = is_most;
        }
    }
}

/// The colour on one side of the edge, on each ray.
struct Side {
    mean: RayColours,
    /// Variance of all channels together, grey levels².
    variance: [f32; RAYS],
}

/// Returns the colour that some samples have on each ray.
#[inline(always)]
fn side(samples: &[RayColours]) -> Side {
    let count = samples.len() as f32;
    let (mut mean, mut variance) = ([[0.0; RAYS]; 3], [0.0; RAYS]);
    for (c, mean) in mean.iter_mut().enumerate() {
        for colours in samples {
            for ray in 0..RAYS {
                mean[ray] += colours[c][ray];
            }
        }
        mean.iter_mut().for_each(|mean| *mean /= count);
        for colours in samples {
            for ray in 0..RAYS {
                variance[ray] += (colours[c][ray] - mean[ray]).powi(2) / count;
            }
        }
    }
    Side { mean, variance }
}
