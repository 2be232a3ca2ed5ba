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

    /// The sums of the squares of half size `half` about every pixel of row `y`.
    fn squares(&self, y: usize, half: usize) -> impl Iterator<Item = f32> {
        let row = |dy: usize, dx: usize| {
            let at = (y + self.margin + dy - half) * self.stride + self.margin + dx - half;
            self.sums[at..at + self.width].iter()
        };
        let side = 2 * half + 1;
        row(0, 0)
            .zip(row(0, side))
            .zip(row(side, 0).zip(row(side, side)))
            .map(|((a, b), (c, d))| (d - b - c + a) as f32 / ONE)
    }

    /// How much more coloured the middle is than what is around it, for discs of `radius` coarse pixels, at every
    /// pixel.
    fn responses(&self, radius: f64) -> Vec<f32> {
        let [inner, disc, outer] = SQUARES.map(|part| (part * radius).round() as usize);
        let area = |half: usize| ((2 * half + 1) * (2 * half + 1)) as f32;
        let (inside, around) = (area(inner).recip(), (area(outer) - area(disc)).recip());
        let mut map = Vec::with_capacity(self.width * self.height);
        for y in 0..self.height {
            let squares = self.squares(y, inner).zip(self.squares(y, disc).zip(self.squares(y, outer)));
            map.extend(squares.map(|(middle, (gap, all))| {
                let (middle, rim) = (middle * inside, (all - gap) * around);
                let difference = middle - rim;
                let response = difference / (middle + rim + DARK);
                if difference < MIN_DIFFERENCE { 0.0 } else { response }
            }));
        }
        map
    }

    /// Adds the local maxima of the response for discs of `radius` coarse pixels.
    fn peaks(&self, radius: f64, found: &mut Vec<Proposal>) {
        let map = self.responses(radius);
        for y in 0..self.height {
            for x in 0..self.width {
                let response = map[y * self.width + x];
                if response > 0.0 && self.is_peak(&map, x, y) {
                    let (u, v) = self.coarse.full(x as f64, y as f64);
                    let disc = Disc { u, v, radius: radius * SHRINK };
                    found.push(Proposal { disc, response });
                }
            }
        }
    }

    /// Whether no neighbour of (`x`, `y`) is larger (of equal ones the first is taken).
    fn is_peak(&self, map: &[f32], x: usize, y: usize) -> bool {
        let here = map[y * self.width + x];
        (y.saturating_sub(1)..(y + 2).min(self.height)).all(|b| {
            (x.saturating_sub(1)..(x + 2).min(self.width)).all(|a| {
                let there = map[b * self.width + a];
                if (b, a) < (y, x) { there < here } else { there <= here }
            })
        })
    }
}
