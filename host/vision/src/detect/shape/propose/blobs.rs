//! Blobs of the ball's colour, of any size that a ball can have.
//!
//! The response of a disc is the mean likeness in a square within it less that in a frame around
//! it, over the sum of both. Squares are summed with an integral image.

use super::super::ball_colour::larger;
use super::super::downsampled::LikenessMap;
use super::super::parameters::BlobParameters;
use super::super::view::Disc;

/// Values that are checked for a peak together.
const CHUNK: usize = 32;
/// Fixed point of the summed likeness: 8 million downsampled pixels fit 31 bits, an image of 128
/// million pixels.
const ONE: f32 = 256.0;

/// A blob of the ball's colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proposal {
    /// Place and size, pixels of the full image.
    pub disc: Disc,
    /// Difference of the likenesses inside and around, over their sum: 0 to 1.
    pub response: f32,
}

/// Finds all blobs with a radius within `radii` (least and largest, pixels of the full image), the
/// strongest response first.
pub(super) fn find_blobs(
    map: &LikenessMap,
    radii: (f64, f64),
    parameters: &BlobParameters,
) -> Vec<Proposal> {
    // Nothing larger than the image is seen in it.
    let largest = LikenessMap::FACTOR * map.width().max(map.height()) as f64 / 2.0;
    let radii = (radii.0, radii.1.min(largest));
    let integral = IntegralImage::new(map, radii.1, parameters);
    let mut all = Vec::new();
    let mut radius = (radii.0 / LikenessMap::FACTOR).max(parameters.min_radius);
    while radius < radii.1 / LikenessMap::FACTOR * parameters.scale_step.sqrt() {
        integral.find_peaks(radius, &mut all);
        radius *= parameters.scale_step;
    }
    all.sort_by(|a, b| b.response.total_cmp(&a.response));
    all
}

/// Sums of the likeness over any upright rectangle of the downsampled image, which has a margin of
/// zeros around it so that no rectangle leaves it.
///
/// OpenCV's `copyMakeBorder` and `integral` take 79 µs for a map of 160x120 (f32 to f32, whose sums
/// are too coarse, or to f64), these fixed-point sums 46 µs.
struct IntegralImage<'a> {
    map: &'a LikenessMap,
    parameters: &'a BlobParameters,
    width: usize,
    height: usize,
    margin: usize,
    /// Corners in a row: width + 2 margin + 1.
    stride: usize,
    /// Sum over all pixels above and left of a corner.
    sums: Vec<i32>,
}

impl<'a> IntegralImage<'a> {
    /// Sums an image in which discs of up to `largest` pixels are looked for.
    fn new(map: &'a LikenessMap, largest: f64, parameters: &'a BlobParameters) -> Self {
        let (width, height) = (map.width(), map.height());
        let reach = parameters.scale_step * parameters.outer_square;
        let margin = (largest / LikenessMap::FACTOR * reach).ceil() as usize + 1;
        let stride = width + 2 * margin + 1;
        let mut sums = vec![0; stride * (height + 2 * margin + 1)];
        for (y, line) in map.values().chunks_exact(width).enumerate() {
            let (above, row) = sums[(margin + y) * stride..].split_at_mut(stride);
            let mut sum = 0;
            let corners = row[margin + 1..].iter_mut().zip(&above[margin + 1..]);
            for (value, (corner, above)) in line.iter().zip(corners) {
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
        Self { map, parameters, width, height, margin, stride, sums }
    }

    /// Returns the rows of corners whose differences are the sums of the squares of half size
    /// `half` about the pixels of row `y`.
    fn corners(&self, y: usize, half: usize) -> [&[i32]; 4] {
        let side = 2 * half + 1;
        [(0, 0), (0, side), (side, 0), (side, side)].map(|(dy, dx)| {
            let at = (y + self.margin + dy - half) * self.stride + self.margin + dx - half;
            &self.sums[at..][..self.width]
        })
    }

    /// Checks whether no square within `half` rows of row `y` can reach the least difference.
    fn is_empty_row(&self, y: usize, half: usize) -> bool {
        let edge = |dy: usize, x: usize| self.sums[(y + self.margin + dy - half) * self.stride + x];
        let (left, right, side) = (self.margin, self.margin + self.width, 2 * half + 1);
        let sum = edge(side, right) - edge(side, left) - edge(0, right) + edge(0, left);
        (sum as f32) < self.parameters.min_difference * ONE * (side * side) as f32
    }

    /// Returns the responses of discs of `radius` downsampled pixels, at every `stride`th pixel of
    /// every `stride`th row.
    fn responses(&self, radius: f64, stride: usize) -> ResponseMap {
        let &BlobParameters { inner_square, disc_square, outer_square, .. } = self.parameters;
        let (least, offset) =
            (self.parameters.min_difference, self.parameters.normalisation_offset);
        let halves =
            [inner_square, disc_square, outer_square].map(|part| (part * radius).round() as usize);
        let [inner, disc, outer] = halves.map(|half| ((2 * half + 1) * (2 * half + 1)) as f32);
        let (inside, around) = ((inner * ONE).recip(), ((outer - disc) * ONE).recip());
        let mut map = ResponseMap::new(self.width.div_ceil(stride), self.height.div_ceil(stride));
        let mut line = vec![0.0; self.width];
        for (y, row) in (0..self.height).step_by(stride).zip(1..) {
            if self.is_empty_row(y, halves[0]) {
                continue;
            }
            let [inner, disc, outer] = halves.map(|half| self.corners(y, half));
            // Neither the sums nor their differences overflow. Wrapping arithmetic has no checks,
            // so the compiler computes several at once.
            let sum = |[a, b, c, d]: [&[i32]; 4], x: usize| {
                a[x].wrapping_sub(b[x]).wrapping_sub(c[x]).wrapping_add(d[x])
            };
            for (x, response) in line.iter_mut().enumerate() {
                let middle = sum(inner, x) as f32 * inside;
                let rim = sum(outer, x).wrapping_sub(sum(disc, x)) as f32 * around;
                let (difference, both) = (middle - rim, middle + rim + offset);
                *response = if difference < least { 0.0 } else { difference / both };
            }
            map.set(row, &line, stride);
        }
        map
    }

    /// Adds the local maxima of the response of discs of `radius` downsampled pixels.
    fn find_peaks(&self, radius: f64, found: &mut Vec<Proposal>) {
        // The response of large discs changes slowly.
        let stride = ((radius / self.parameters.strides_per_radius) as usize).max(1);
        self.responses(radius, stride).each_peak(|x, y, response| {
            let (u, v) = self.map.to_full((x * stride) as f64, (y * stride) as f64);
            let radius = radius * LikenessMap::FACTOR;
            found.push(Proposal { disc: Disc { u, v, radius }, response });
        });
    }
}

/// Responses, with a margin of zeros one pixel wide around them.
struct ResponseMap {
    values: Vec<f32>,
    /// With the margin.
    width: usize,
}

impl ResponseMap {
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

    /// Calls `f` with column, row and value of each value above zero that has no larger neighbour;
    /// of equal neighbours the first one counts.
    ///
    /// OpenCV's `dilate` and a pass that finds the first of equal values take 63 µs for 160x120
    /// responses, this pass 48 µs.
    fn each_peak(&self, mut f: impl FnMut(usize, usize, f32)) {
        let width = self.width;
        // The largest of three rows, and of each three of those.
        let (mut columns, mut around) = (vec![0.0; width], vec![0.0; width - 2]);
        for (y, rows) in self.values.windows(3 * width).step_by(width).enumerate() {
            let (above, rest) = rows.split_at(width);
            let (row, below) = rest.split_at(width);
            for (((most, a), b), c) in columns.iter_mut().zip(above).zip(row).zip(below) {
                *most = larger(larger(*a, *b), *c);
            }
            let threes = columns.iter().zip(&columns[1..]).zip(&columns[2..]);
            for (around, ((a, b), c)) in around.iter_mut().zip(threes) {
                *around = larger(larger(*a, *b), *c);
            }
            let is_peak = |here: f32, around: f32| (here > 0.0) & (here >= around);
            let chunks = row[1..].chunks(CHUNK).zip(around.chunks(CHUNK));
            for (start, (chunk, around)) in (0..).step_by(CHUNK).zip(chunks) {
                let pairs = chunk.iter().zip(around);
                // Most chunks have no peak.
                if !pairs.clone().fold(false, |any, (here, around)| any | is_peak(*here, *around)) {
                    continue;
                }
                for (x, (here, around)) in (start..).zip(pairs) {
                    let before = [above[x], above[x + 1], above[x + 2], row[x]];
                    if is_peak(*here, *around) && before.iter().all(|before| here > before) {
                        f(x, y, *here);
                    }
                }
            }
        }
    }
}
