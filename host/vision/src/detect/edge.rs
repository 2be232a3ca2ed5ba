//! A ball's outline to a fraction of a pixel.
//!
//! Near its edge a pixel shows a mixture of the ball's colour and of what is behind it, and the
//! edge is where it is half of each. Both colours are read on each ray by itself, inside and
//! outside, so that neither shading nor highlights nor exposure nor what is behind shifts it, and
//! blur and motion, which spread the mixture evenly to both sides, do not either. The circle
//! through these places is fitted by least squares with outliers cut off (Tukey), with the radius
//! drawn to what depth says of it.

use nalgebra::{Matrix2, Matrix3, Vector3};

use super::picture::{Disc, Picture};
use super::rays::RAYS;

/// Samples on a ray to either side of the expected edge.
const HALF: usize = 12;
/// Samples on a ray.
const SAMPLES: usize = 2 * HALF + 1;
/// How far to either side of the edge is looked at first, step by step: in the disc's radius, and
/// pixels at least.
const BANDS: [(f64, f64); 4] = [(0.5, 4.0), (0.4, 3.5), (0.35, 1.8), (0.35, 1.2)];
/// How far at most where the start is known well, in the disc's radius.
const HELD: f64 = 0.25;
/// How far is looked once it is known how blurred the edge is: in the standard deviation of its
/// blur, and pixels more. Nearer, and both colours are mixed; farther, and they are others than at
/// the edge.
const NARROW: (f64, f64) = (1.3, 0.35);
/// Rays to either side of a ray, and of its opposite, that its blur is taken from: blur and motion
/// are the same to both sides.
const BESIDE: usize = 2;
/// By how much an edge is moved that is wider than the opposite one, in that difference, and the
/// most difference, pixels.
const GLEAM: (f64, f64) = (1.3, 0.6);
/// Edges farther from the disc than this part of the band are not believed.
const CUT: f64 = 0.8;
/// What a radius known from depth may be wrong by (standard deviation): in itself, and pixels more.
const RADIUS_ERROR: (f64, f64) = (0.005, 0.1);
/// Standard deviation of one ray's edge, pixels, as long as the residuals do not say otherwise.
const EDGE_ERROR: f64 = 0.4;
/// What all edges may have in common (standard deviation), pixels: a limb that mirrors what is
/// beside it.
const SYSTEMATIC: f64 = 0.09;
/// The blur (standard deviation, pixels) of a sharp picture's edges, and what more of it adds to
/// what they have in common.
const BLURRED: (f64, f64) = (0.5, 0.45);
/// What a disc may be off besides where its edges are blurred beyond a sharp picture's (standard
/// deviation): in that blur and in what the edges are off the disc, pixels either. Of a ball that
/// moved, over what is of many colours, the edges are off together on one side.
const SMEARED: f64 = 3.5;
/// Difference of colours, grey levels, that is half believed.
const FAINT: f32 = 12.0;
/// An edge so near to the disc's is the disc's: in its radius, and pixels more.
const TOUCHING: (f64, f64) = (0.05, 0.3);
/// The weight from which on an edge is clear.
const CLEAR: f64 = 0.3;
/// The least sum of weights of a fit, rays.
const MIN_WEIGHT: f64 = 4.0;

/// A disc and how sure it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fine {
    pub(super) disc: Disc,
    /// Of column, row and radius, pixels².
    pub(super) covariance: Matrix3<f64>,
    /// Whether each ray has a clear edge where the disc ends.
    pub(super) edges: [bool; RAYS],
    /// Standard deviation of the edges' blur, pixels: the median.
    pub(super) blur: f64,
    /// By how much the edges are off the disc as they are looked for some pixels about it (root of
    /// the mean square), pixels.
    pub(super) uneven: f64,
}

impl Fine {
    /// How many rays have such an edge.
    pub(super) fn found(&self) -> f64 {
        self.edges.iter().filter(|&&e| e).count() as f64
    }

    /// The covariance of column and row, pixels².
    pub(super) fn place(&self) -> Matrix2<f64> {
        let smeared = SMEARED * self.uneven * (self.blur - BLURRED.0).max(0.0);
        self.covariance.fixed_view::<2, 2>(0, 0) + Matrix2::identity() * smeared.powi(2)
    }
}

/// Where a ray passes from the ball to what is behind it.
#[derive(Clone, Copy)]
struct Edge {
    /// Pixels outwards from where it was expected.
    off: f64,
    /// 0 to 1: by how much both colours differ, against their own unevenness.
    weight: f64,
    /// Standard deviation of its blur, pixels.
    blur: f64,
}

impl Picture<'_> {
    /// The disc near `start` fitted to the edges of the `trusted` rays, its radius near `radius`
    /// where that is known; `None` where too few edges are seen. Edges are looked for less far from
    /// `start` if that is `held`.
    pub(super) fn refine_edges(
        &self,
        start: Disc,
        radius: Option<f64>,
        trusted: &[bool; RAYS],
        held: bool,
    ) -> Option<Fine> {
        let mut fine = Fine {
            disc: start,
            covariance: Matrix3::identity(),
            edges: [false; RAYS],
            blur: 0.0,
            uneven: 0.0,
        };
        let mut blurs = [None; RAYS];
        let most = if held { HELD } else { 1.0 };
        let mut uneven = 0.0;
        for (pass, (part, least)) in
            BANDS.map(|(part, least)| (part.min(most), least)).into_iter().enumerate()
        {
            let widest = (part * fine.disc.radius).max(least);
            let bands = blurs.map(|blur: Option<f64>| {
                blur.map_or(widest, |b| (NARROW.0 * b + NARROW.1).clamp(least.min(widest), widest))
            });
            let edges = self.edges(&fine.disc, &bands, trusted);
            let edges = without_gleam(edges);
            fine = self.refit(&fine.disc, &edges, widest, radius)?;
            // Later on edges that are off are not looked for, and before their places are rough.
            if pass == 1 {
                uneven = fine.uneven;
            }
            blurs = std::array::from_fn(|ray| blur_about(&edges, ray));
        }
        fine.uneven = uneven;
        // Where a blurred edge is is a matter of what it is blurred with.
        let mut known: Vec<f64> = blurs.iter().flatten().copied().collect();
        known.sort_by(f64::total_cmp);
        fine.blur = known.get(known.len() / 2).copied().unwrap_or(0.0);
        fine.covariance +=
            Matrix3::identity() * (BLURRED.1 * (fine.blur - BLURRED.0).max(0.0)).powi(2);
        Some(fine)
    }

    /// The disc moved and grown so that it fits `edges`, of which those farther than `band` pixels
    /// are outliers.
    fn refit(
        &self,
        disc: &Disc,
        edges: &[Option<Edge>; RAYS],
        band: f64,
        radius: Option<f64>,
    ) -> Option<Fine> {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        let (mut squares, mut sum) = (0.0, 0.0);
        for (edge, (cos, sin)) in edges.iter().zip(self.directions()) {
            let Some(edge) = edge else { continue };
            let off = (edge.off / (CUT * band)).clamp(-1.0, 1.0);
            let weight = edge.weight * (1.0 - off * off).powi(2);
            let row = Vector3::new(*cos, *sin, 1.0);
            normal += row * row.transpose() * weight;
            right += row * edge.off * weight;
            squares += edge.off * edge.off * weight;
            sum += weight;
        }
        if sum < MIN_WEIGHT {
            return None;
        }
        if let Some(radius) = radius {
            let error = RADIUS_ERROR.0 * radius + RADIUS_ERROR.1;
            let weight = (EDGE_ERROR / error).powi(2);
            normal[(2, 2)] += weight;
            right.z += (radius - disc.radius) * weight;
        }
        // A direction that no edge speaks of must not move the disc far.
        normal += Matrix3::identity() * 0.05;
        let inverse = normal.try_inverse()?;
        let step = inverse * right;
        let uneven = (squares - step.dot(&right)).max(0.0) / sum;
        let residual = uneven.max(EDGE_ERROR * EDGE_ERROR);
        let near = TOUCHING.0 * disc.radius + TOUCHING.1;
        let edges = std::array::from_fn(|ray| {
            let (cos, sin) = self.directions()[ray];
            edges[ray].is_some_and(|e| {
                e.weight > CLEAR && (e.off - step.x * cos - step.y * sin - step.z).abs() < near
            })
        });
        let covariance = inverse * residual + Matrix3::identity() * (SYSTEMATIC * SYSTEMATIC);
        Some(Fine {
            disc: self.rays(disc).moved(disc.radius, &step),
            covariance,
            edges,
            blur: 0.0,
            uneven: uneven.sqrt(),
        })
    }

    /// The edge of each trusted ray, looked for within its band, where it has one.
    fn edges(
        &self,
        disc: &Disc,
        bands: &[f64; RAYS],
        trusted: &[bool; RAYS],
    ) -> [Option<Edge>; RAYS] {
        let rays = self.rays(disc);
        std::array::from_fn(|ray| {
            let step = bands[ray] / HALF as f64;
            let mut samples = [[0.0; 3]; SAMPLES];
            let start = disc.radius - bands[ray];
            let inside = trusted[ray] && rays.blended(ray, start, step, &mut samples);
            inside.then(|| edge(&samples, step)).flatten()
        })
    }
}

/// The edges with those moved outwards that a gleam has moved inwards: what is seen along its
/// surface mirrors what is around it, so that on one side the limb may be as bright as what is
/// behind it. Such an edge is wider than the opposite one, on its inner side; blur and motion would
/// be the same to both sides.
fn without_gleam(edges: [Option<Edge>; RAYS]) -> [Option<Edge>; RAYS] {
    std::array::from_fn(|ray| {
        let edge = edges[ray]?;
        let (Some(here), Some(there)) = (side_blur(&edges, ray), side_blur(&edges, ray + RAYS / 2))
        else {
            return Some(edge);
        };
        Some(Edge { off: edge.off + GLEAM.0 * (here - there).clamp(0.0, GLEAM.1), ..edge })
    })
}

/// The median blur of the edges about `ray`.
fn side_blur(edges: &[Option<Edge>; RAYS], ray: usize) -> Option<f64> {
    let mut blurs = [0.0; 2 * BESIDE + 1];
    let mut n = 0;
    for i in 0..2 * BESIDE + 1 {
        if let Some(edge) = edges[(ray + RAYS + i - BESIDE) % RAYS] {
            blurs[n] = edge.blur;
            n += 1;
        }
    }
    blurs[..n].sort_by(f64::total_cmp);
    (n > BESIDE).then(|| blurs[n / 2])
}

/// The median blur of the edges about `ray` and about its opposite.
fn blur_about(edges: &[Option<Edge>; RAYS], ray: usize) -> Option<f64> {
    let mut blurs = [0.0; 2 * (2 * BESIDE + 1)];
    let mut n = 0;
    for i in 0..2 * BESIDE + 1 {
        for side in [0, RAYS / 2] {
            if let Some(edge) = edges[(ray + RAYS + i - BESIDE + side) % RAYS] {
                blurs[n] = edge.blur;
                n += 1;
            }
        }
    }
    blurs[..n].sort_by(f64::total_cmp);
    (n >= BESIDE).then(|| blurs[n / 2])
}

/// The edge in the samples of a ray.
fn edge(samples: &[[f32; 3]; SAMPLES], step: f64) -> Option<Edge> {
    let (inner, inner_spread) = level(&samples[..HALF / 2]);
    let (outer, outer_spread) = level(&samples[SAMPLES - HALF / 2..]);
    let way: [f32; 3] = std::array::from_fn(|c| inner[c] - outer[c]);
    let squared = way.iter().map(|d| d * d).sum::<f32>();
    if squared < 1.0 {
        return None;
    }
    // How much of the ball each sample shows, less a half.
    let share =
        samples.map(|s| (0..3).map(|c| (s[c] - outer[c]) * way[c]).sum::<f32>() / squared - 0.5);
    // The most likely place of a step between both levels: as much of the ball before it as
    // possible, as much of what is behind it beyond.
    let (mut sum, mut best, mut at) = (0.0, f32::NEG_INFINITY, 0);
    for (k, share) in share.iter().enumerate().take(SAMPLES - 1) {
        sum += share.clamp(-0.5, 0.5);
        if sum > best {
            (best, at) = (sum, k);
        }
    }
    let (before, after) = (share[at], share[at + 1]);
    if before < 0.0 || after > 0.0 || before - after < 1e-6 {
        return None;
    }
    let off = (at as f64 + f64::from(before / (before - after)) - HALF as f64) * step;
    let noise = 4.0 * (inner_spread + outer_spread) + FAINT * FAINT;
    // Of a Gaussian edge the integral of share (1 - share) is its standard deviation over the root
    // of π.
    let mixed = share.iter().map(|s| 0.25 - s.clamp(-0.5, 0.5).powi(2)).sum::<f32>();
    let blur = f64::from(mixed) * step * std::f64::consts::PI.sqrt();
    Some(Edge { off, blur, weight: f64::from(squared / (squared + noise)) })
}

/// Mean colour and variance (of all channels together) of some samples.
fn level(samples: &[[f32; 3]]) -> ([f32; 3], f32) {
    let n = samples.len() as f32;
    let mean: [f32; 3] = std::array::from_fn(|c| samples.iter().map(|s| s[c]).sum::<f32>() / n);
    let spread =
        samples.iter().flat_map(|s| (0..3).map(move |c| (s[c] - mean[c]).powi(2))).sum::<f32>() / n;
    (mean, spread)
}
