//! Where a ball might be: blobs of its colour of any size that a ball can have, in a picture of a quarter of the size.

use opencv::core::{Mat, MatTraitConst, MatTraitConstManual, Rect, Size, Vec3b};
use opencv::imgproc::{INTER_AREA, resize};

use super::DetectError;
use super::colour::BallColour;
use super::outline::Disc;

/// Pixels of the full picture in a pixel of the coarse one.
const SHRINK: f64 = 4.0;
/// From one radius that is looked for to the next.
const SCALE_STEP: f64 = 1.4;
/// The smallest radius that is looked for, coarse pixels.
const MIN_RADIUS: f64 = 1.5;
/// Half sizes, as parts of the radius, of three squares about a place: within the disc, around it, and around
/// that.
const SQUARES: [f64; 3] = [0.62, 1.15, 1.8];
/// A disc's radius in steps from one place to the next that is looked at.
const RADIUS_IN_STRIDES: f64 = 3.0;
/// Colour in the middle over that around it, at least; less is noise.
const MIN_DIFFERENCE: f32 = 0.02;
/// The response divides the difference by the colour there is, so that dim balls beside bright things
/// are not passed over; this keeps it from dividing noise by nothing.
const DARK: f32 = 0.1;
/// Fixed point of the summed colour: 8 million coarse pixels of it fit 31 bits, a picture of 128 million
/// pixels.
const ONE: f32 = 256.0;

/// A place where a ball might be, in pixels of the full picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Proposal {
    /// Where, and how large.
    pub(super) disc: Disc,
    /// How much more coloured the middle is than what is around it, relative to both: 0 to 1.
    pub(super) response: f32,
}

/// The ball's colour in a window of the picture, at a quarter of the size.
pub(super) struct Coarse {
    width: usize,
    height: usize,
    /// Column and row of the window's first pixel in the full picture.
    origin: (f64, f64),
    /// How much each pixel has of the ball's colour, 0 to 1.
    values: Vec<f32>,
}

impl Coarse {
    /// Of `window`, which is in the picture and not empty.
    pub(super) fn new(colour: &Mat, window: Rect, ball: BallColour) -> Result<Self, DetectError> {
        let coarse = |n: i32| ((f64::from(n) / SHRINK) as i32).max(1);
        let size = Size::new(coarse(window.width), coarse(window.height));
        let mut small = Mat::default();
        resize(&colour.roi(window)?, &mut small, size, 0.0, 0.0, INTER_AREA)?;
        let values = small.data_typed::<Vec3b>()?.iter().map(|&pixel| ball.of(pixel)).collect();
        let origin = (f64::from(window.x), f64::from(window.y));
        Ok(Self { width: size.width as usize, height: size.height as usize, origin, values })
    }

    /// The full picture's column and row of the middle of each pixel, and its value.
    pub(super) fn pixels(&self) -> impl Iterator<Item = (f64, f64, f32)> {
        self.values.iter().enumerate().map(|(i, &value)| {
            let (u, v) = self.full((i % self.width) as f64, (i / self.width) as f64);
            (u, v, value)
        })
    }

    /// The number of the pixel where the full picture has column `u`, row `v`, in the order of [`Coarse::pixels`]; `None`
    /// outside.
    pub(super) fn index(&self, u: f64, v: f64) -> Option<usize> {
        let (x, y) = ((u + 0.5 - self.origin.0) / SHRINK, (v + 0.5 - self.origin.1) / SHRINK);
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside.then(|| y as usize * self.width + x as usize)
    }

    /// The value of a pixel.
    pub(super) fn value(&self, index: usize) -> f32 {
        self.values[index]
    }

    /// All places for a ball of a radius within `radii` (pixels), the most promising first.
    pub(super) fn propose(&self, radii: (f64, f64)) -> Vec<Proposal> {
        // Nothing larger than the picture is seen in it.
        let radii = (radii.0, radii.1.min(SHRINK * self.width.max(self.height) as f64 / 2.0));
        let sums = Sums::of(self, radii.1);
        let mut all = Vec::new();
        let mut radius = (radii.0 / SHRINK).max(MIN_RADIUS);
        while radius < radii.1 / SHRINK * SCALE_STEP.sqrt() {
            sums.peaks(radius, &mut all);
            radius *= SCALE_STEP;
        }
        all.sort_by(|a, b| b.response.total_cmp(&a.response));
        all
    }

    /// Where a coarse pixel is in the full picture.
    fn full(&self, x: f64, y: f64) -> (f64, f64) {
        ((x + 0.5) * SHRINK - 0.5 + self.origin.0, (y + 0.5) * SHRINK - 0.5 + self.origin.1)
    }
}

/// Sums of the ball's colour over any upright rectangle of the coarse picture, which has a margin without any around
/// it so that no rectangle leaves it.
struct Sums<'a> {
    coarse: &'a Coarse,
    width: usize,
    height: usize,
    margin: usize,
    /// Corners in a row: width + 2 margin + 1.
    stride: usize,
    /// The sum over all that is above and left of a corner.
    sums: Vec<i32>,
}

impl<'a> Sums<'a> {
    /// Of a picture in which discs of up to `largest` pixels are looked for.
    fn of(coarse: &'a Coarse, largest: f64) -> Self {
        let (width, height) = (coarse.width, coarse.height);
        let margin = (largest / SHRINK * SCALE_STEP * SQUARES[2]).ceil() as usize + 1;
        let stride = width + 2 * margin + 1;
        let mut sums = vec![0; stride * (height + 2 * margin + 1)];
        for (y, line) in coarse.values.chunks_exact(width).enumerate() {
            let (above, row) = sums[(margin + y) * stride..].split_at_mut(stride);
            let mut sum = 0;
            for ((value, corner), above) in line.iter().zip(&mut row[margin + 1..]).zip(&above[margin + 1..])
            {
                sum += (value * ONE + 0.5) as i32;
                *corner = above + sum;
            }
            for x in margin + width + 1..stride {
                row[x] = above[x] + sum;
            }
        }
        for y in margin + height..height + 2 * margin {
            sums.copy_within(y * stride..(y + 1) * stride, (y + 1) * stride);
        }
        Self { coarse, width, height, margin, stride, sums }
    }

    /// The rows of corners whose differences are the sums of the squares of half size `half` about the pixels of row `y`.
    fn corners(&self, y: usize, half: usize) -> [&[i32]; 4] {
        let side = 2 * half + 1;
        [(0, 0), (0, side), (side, 0), (side, side)].map(|(dy, dx)| {
            let at = (y + self.margin + dy - half) * self.stride + self.margin + dx - half;
            &self.sums[at..at + self.width]
        })
    }

    /// Whether there is next to nothing of the colour within `half` rows of row `y`.
    fn is_bare(&self, y: usize, half: usize) -> bool {
        let edge = |dy: usize, x: usize| self.sums[(y + self.margin + dy - half) * self.stride + x];
        let (left, right, side) = (self.margin, self.margin + self.width, 2 * half + 1);
        let sum = edge(side, right) - edge(side, left) - edge(0, right) + edge(0, left);
        (sum as f32) < MIN_DIFFERENCE * ONE * (side * side) as f32
    }

    /// How much more coloured the middle is than what is around it, for discs of `radius` coarse pixels, at every
    /// `stride`th pixel of every `stride`th row.
    fn responses(&self, radius: f64, stride: usize) -> Vec<f32> {
        let halves = SQUARES.map(|part| (part * radius).round() as usize);
        let [inner, disc, outer] = halves.map(|half| ((2 * half + 1) * (2 * half + 1)) as f32);
        let (inside, around) = ((inner * ONE).recip(), ((outer - disc) * ONE).recip());
        let mut map = Vec::with_capacity(self.width.div_ceil(stride) * self.height.div_ceil(stride));
        for y in (0..self.height).step_by(stride) {
            if self.is_bare(y, halves[0]) {
                map.resize(map.len() + self.width.div_ceil(stride), 0.0);
                continue;
            }
            let [inner, disc, outer] = halves.map(|half| self.corners(y, half));
            // Sums fit, and so do their differences; said so that several are computed at once.
            let sum = |[a, b, c, d]: &[&[i32]; 4], x: usize| {
                a[x].wrapping_sub(b[x]).wrapping_sub(c[x]).wrapping_add(d[x])
            };
            map.extend((0..self.width).step_by(stride).map(|x| {
                let middle = sum(&inner, x) as f32 * inside;
                let rim = sum(&outer, x).wrapping_sub(sum(&disc, x)) as f32 * around;
                let difference = middle - rim;
                if difference < MIN_DIFFERENCE { 0.0 } else { difference / (middle + rim + DARK) }
            }));
        }
        map
    }

    /// Adds the local maxima of the response for discs of `radius` coarse pixels.
    fn peaks(&self, radius: f64, found: &mut Vec<Proposal>) {
        // Large discs answer alike over many pixels.
        let stride = ((radius / RADIUS_IN_STRIDES) as usize).max(1);
        let map = Map { values: self.responses(radius, stride), width: self.width.div_ceil(stride) };
        for (at, &response) in map.values.iter().enumerate().filter(|(_, response)| **response > 0.0) {
            let (x, y) = (at % map.width, at / map.width);
            if map.is_peak(x, y) {
                let (u, v) = self.coarse.full((x * stride) as f64, (y * stride) as f64);
                let disc = Disc { u, v, radius: radius * SHRINK };
                found.push(Proposal { disc, response });
            }
        }
    }
}

/// Responses, row by row.
struct Map {
    values: Vec<f32>,
    width: usize,
}

impl Map {
    /// Whether no neighbour of (`x`, `y`) is larger (of equal ones the first is taken).
    fn is_peak(&self, x: usize, y: usize) -> bool {
        let height = self.values.len() / self.width;
        let here = self.values[y * self.width + x];
        (y.saturating_sub(1)..(y + 2).min(height)).all(|b| {
            (x.saturating_sub(1)..(x + 2).min(self.width)).all(|a| {
                let there = self.values[b * self.width + a];
                if (b, a) < (y, x) { there < here } else { there <= here }
            })
        })
    }
}
