//! Where a ball might be: blobs of its colour of any size that a ball can have, in a picture of a
//! quarter of the size.

use super::coarse::Coarse;
use super::colour::larger;
use super::picture::Disc;

/// From one radius that is looked for to the next.
const SCALE_STEP: f64 = 1.4;
/// The smallest radius that is looked for, coarse pixels.
const MIN_RADIUS: f64 = 1.5;
/// Half sizes, as parts of the radius, of three squares about a place: within the disc, around it,
/// and around that.
const SQUARES: [f64; 3] = [0.62, 1.15, 1.8];
/// A disc's radius in steps from one place to the next that is looked at.
const RADIUS_IN_STRIDES: f64 = 3.0;
/// Colour in the middle over that around it, at least; less is noise.
const MIN_DIFFERENCE: f32 = 0.02;
/// The response divides the difference by the colour there is, so that dim balls beside bright
/// things are not passed over; this keeps it from dividing noise by nothing.
const DARK: f32 = 0.1;
/// Places that are asked together whether one of them is a peak.
const AT_ONCE: usize = 32;
/// Fixed point of the summed colour: 8 million coarse pixels of it fit 31 bits, a picture of 128
/// million pixels.
const ONE: f32 = 256.0;

/// A place where a ball might be, in pixels of the full picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Proposal {
    /// Where, and how large.
    pub(super) disc: Disc,
    /// How much more coloured the middle is than what is around it, relative to both: 0 to 1.
    pub(super) response: f32,
}

impl Coarse {
    /// All places for a ball of a radius within `radii` (pixels), the most promising first.
    pub(super) fn propose(&self, radii: (f64, f64)) -> Vec<Proposal> {
        // Nothing larger than the picture is seen in it.
        let radii =
            (radii.0, radii.1.min(Coarse::SHRINK * self.width().max(self.height()) as f64 / 2.0));
        let sums = Sums::of(self, radii.1);
        let mut all = Vec::new();
        let mut radius = (radii.0 / Coarse::SHRINK).max(MIN_RADIUS);
        while radius < radii.1 / Coarse::SHRINK * SCALE_STEP.sqrt() {
            sums.peaks(radius, &mut all);
            radius *= SCALE_STEP;
        }
        all.sort_by(|a, b| b.response.total_cmp(&a.response));
        all
    }
}

/// Sums of the ball's colour over any upright rectangle of the coarse picture, which has a margin
/// without any around it so that no rectangle leaves it.
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
        let (width, height) = (coarse.width(), coarse.height());
        let margin = (largest / Coarse::SHRINK * SCALE_STEP * SQUARES[2]).ceil() as usize + 1;
        let stride = width + 2 * margin + 1;
        let mut sums = vec![0; stride * (height + 2 * margin + 1)];
        for (y, line) in coarse.values().chunks_exact(width).enumerate() {
            let (above, row) = sums[(margin + y) * stride..].split_at_mut(stride);
            let mut sum = 0;
            for ((value, corner), above) in
                line.iter().zip(&mut row[margin + 1..]).zip(&above[margin + 1..])
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

    /// The rows of corners whose differences are the sums of the squares of half size `half` about
    /// the pixels of row `y`.
    fn corners(&self, y: usize, half: usize) -> [&[i32]; 4] {
        let side = 2 * half + 1;
        [(0, 0), (0, side), (side, 0), (side, side)].map(|(dy, dx)| {
            let at = (y + self.margin + dy - half) * self.stride + self.margin + dx - half;
            &self.sums[at..][..self.width]
        })
    }

    /// Whether there is next to nothing of the colour within `half` rows of row `y`.
    fn is_bare(&self, y: usize, half: usize) -> bool {
        let edge = |dy: usize, x: usize| self.sums[(y + self.margin + dy - half) * self.stride + x];
        let (left, right, side) = (self.margin, self.margin + self.width, 2 * half + 1);
        let sum = edge(side, right) - edge(side, left) - edge(0, right) + edge(0, left);
        (sum as f32) < MIN_DIFFERENCE * ONE * (side * side) as f32
    }

    /// How much more coloured the middle is than what is around it, for discs of `radius` coarse
    /// pixels, at every `stride`th pixel of every `stride`th row.
    fn responses(&self, radius: f64, stride: usize) -> Map {
        let halves = SQUARES.map(|part| (part * radius).round() as usize);
        let [inner, disc, outer] = halves.map(|half| ((2 * half + 1) * (2 * half + 1)) as f32);
        let (inside, around) = ((inner * ONE).recip(), ((outer - disc) * ONE).recip());
        let mut map = Map::new(self.width.div_ceil(stride), self.height.div_ceil(stride));
        let mut line = vec![0.0; self.width];
        for (y, row) in (0..self.height).step_by(stride).zip(1..) {
            if self.is_bare(y, halves[0]) {
                continue;
            }
            let [inner, disc, outer] = halves.map(|half| self.corners(y, half));
            // Sums fit, and so do their differences; said so that several are computed at once.
            let sum = |[a, b, c, d]: [&[i32]; 4], x: usize| {
                a[x].wrapping_sub(b[x]).wrapping_sub(c[x]).wrapping_add(d[x])
            };
            for (x, response) in line.iter_mut().enumerate() {
                let middle = sum(inner, x) as f32 * inside;
                let rim = sum(outer, x).wrapping_sub(sum(disc, x)) as f32 * around;
                let (difference, both) = (middle - rim, middle + rim + DARK);
                *response = if difference < MIN_DIFFERENCE { 0.0 } else { difference / both };
            }
            map.set(row, &line, stride);
        }
        map
    }

    /// Adds the local maxima of the response for discs of `radius` coarse pixels.
    fn peaks(&self, radius: f64, found: &mut Vec<Proposal>) {
        // Large discs answer alike over many pixels.
        let stride = ((radius / RADIUS_IN_STRIDES) as usize).max(1);
        self.responses(radius, stride).each_peak(|x, y, response| {
            let (u, v) = self.coarse.full((x * stride) as f64, (y * stride) as f64);
            found.push(Proposal { disc: Disc { u, v, radius: radius * Coarse::SHRINK }, response });
        });
    }
}

/// Responses, with a margin of zeros one pixel wide around them.
struct Map {
    values: Vec<f32>,
    /// With the margin.
    width: usize,
}

impl Map {
    fn new(width: usize, height: usize) -> Self {
        Self { values: vec![0.0; (width + 2) * (height + 2)], width: width + 2 }
    }

    /// Sets a row (the first is 1) to every `stride`th value of `line`.
    fn set(&mut self, row: usize, line: &[f32], stride: usize) {
        let to = &mut self.values[row * self.width + 1..];
        if stride == 1 {
            to[..line.len()].copy_from_slice(line);
        } else {
            to.iter_mut().zip(line.iter().step_by(stride)).for_each(|(to, from)| *to = *from);
        }
    }

    /// Column, row and value of each place above zero that has no larger neighbour (of equal ones
    /// the first is taken).
    fn each_peak(&self, mut f: impl FnMut(usize, usize, f32)) {
        let width = self.width;
        // The largest of three rows, and of each three of those.
        let (mut most, mut around) = (vec![0.0; width], vec![0.0; width - 2]);
        for (y, rows) in self.values.windows(3 * width).step_by(width).enumerate() {
            let (above, rest) = rows.split_at(width);
            let (row, below) = rest.split_at(width);
            for (((most, a), b), c) in most.iter_mut().zip(above).zip(row).zip(below) {
                *most = larger(larger(*a, *b), *c);
            }
            for (((around, a), b), c) in
                around.iter_mut().zip(&most).zip(&most[1..]).zip(&most[2..])
            {
                *around = larger(larger(*a, *b), *c);
            }
            let is_peak = |here: f32, around: f32| (here > 0.0) & (here >= around);
            let chunks = row[1..].chunks(AT_ONCE).zip(around.chunks(AT_ONCE));
            for (start, (chunk, around)) in (0..).step_by(AT_ONCE).zip(chunks) {
                // Most have none.
                if !chunk
                    .iter()
                    .zip(around)
                    .fold(false, |any, (here, around)| any | is_peak(*here, *around))
                {
                    continue;
                }
                for (x, (here, around)) in (start..).zip(chunk.iter().zip(around)) {
                    let before = [above[x], above[x + 1], above[x + 2], row[x]];
                    if is_peak(*here, *around) && before.iter().all(|before| here > before) {
                        f(x, y, *here);
                    }
                }
            }
        }
    }
}
