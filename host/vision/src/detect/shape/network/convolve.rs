//! Layers that convolve each channel by itself.
//!
//! A convolution goes down the rows in strips as wide as a register of the processor: of the three
//! rows that a sum needs, two are known from the sum before. Reading nine pixels for each sum took
//! 1.4 times as long.

use std::array;
use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::map::Map;
use super::weights::Weights;

/// Pixels that a 3x3 convolution reads.
const TAPS: usize = 9;

/// A layer that convolves each channel by itself; negative sums become 0.
pub(super) struct Convolution {
    /// Nine weights for each channel, row by row.
    taps: Vec<[f32; TAPS]>,
    biases: Vec<f32>,
    /// Distance of the pixels that are read.
    dilation: usize,
}

impl Convolution {
    /// Reads the weights of a layer that reads neighbours at `dilation` pixels.
    pub(super) fn new(channels: usize, dilation: usize, weights: &mut Weights) -> Self {
        let taps = weights.take(TAPS * channels).as_chunks().0.to_vec();
        Self { taps, biases: weights.take(channels), dilation }
    }

    /// Returns the distance of the pixels that are read: the border that a map needs.
    pub(super) fn dilation(&self) -> usize {
        self.dilation
    }

    /// Returns the sums for `map`, whose border is 0 and at least as wide as the dilation; the
    /// border of the sums has any finite values.
    pub(super) fn apply(&self, map: &Map) -> Map {
        let mut sums = Map::unset(map.rows, map.columns, map.border, map.channels());
        Arch::new().dispatch(Sums { layer: self, map, target: &mut sums });
        sums
    }
}

/// The sums of a convolution.
struct Sums<'a> {
    layer: &'a Convolution,
    map: &'a Map,
    /// A map of the same size.
    target: &'a mut Map,
}

impl WithSimd for Sums<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { layer: Convolution { taps, biases, dilation }, map, target } = self;
        let (start, width, stride) = (map.start(), map.width(), map.stride());
        // Rows that are narrower than a register are computed as one long row.
        let is_narrow = width < S::F32_LANES;
        let (rows, columns) = if is_narrow { (1, map.span()) } else { (map.rows, width) };
        let first = start - dilation * (width + 1);
        let channels = map.values.chunks_exact(stride).zip(target.values.chunks_exact_mut(stride));
        for ((pixels, sums), (taps, &bias)) in channels.zip(taps.iter().zip(biases)) {
            let taps = taps.map(|tap| simd.splat_f32s(tap));
            let kernel = Kernel { taps, bias: simd.splat_f32s(bias), dilation: *dilation, width };
            for column in (0..columns).step_by(S::F32_LANES) {
                // The last strip overlaps the one before.
                let column = column.min(columns - S::F32_LANES);
                let (pixels, sums) = (&pixels[first + column..], &mut sums[start + column..]);
                (0..*dilation).for_each(|row| kernel.go_down(simd, pixels, sums, row..rows));
            }
        }
    }
}

/// What a strip of sums is computed with.
struct Kernel<S: Simd> {
    taps: [S::f32s; TAPS],
    bias: S::f32s,
    dilation: usize,
    /// Distance of the first pixels of two rows.
    width: usize,
}

impl<S: Simd> Kernel<S> {
    /// Writes the sums of a strip in the first of `rows` and in those that follow at the distance
    /// of the dilation. `pixels` start where the kernel of the strip in row 0 does.
    #[inline(always)]
    fn go_down(&self, simd: S, pixels: &[f32], sums: &mut [f32], rows: Range<usize>) {
        let Self { taps, bias, dilation, width } = self;
        let step = dilation * width;
        let read = |place: usize| -> [S::f32s; 3] {
            let row = &pixels[place..][..2 * dilation + S::F32_LANES];
            array::from_fn(|tap| S::as_simd_f32s(&row[tap * dilation..]).0[0])
        };
        let places = rows.start * width..rows.end * width;
        let (mut upper, mut middle) = (read(places.start), read(places.start + step));
        for place in places.step_by(step) {
            let lower = read(place + 2 * step);
            // A sum for each row: in a single one each product would wait for the one before.
            let lines = [upper, middle, lower].into_iter().zip(taps.as_chunks::<3>().0);
            let sum = lines.fold(*bias, |sum, (line, &taps)| {
                simd.add_f32s(sum, sum_of_products(simd, line, taps))
            });
            let target = S::as_mut_simd_f32s(&mut sums[place..][..S::F32_LANES]).0;
            target[0] = simd.max_f32s(sum, simd.splat_f32s(0.0));
            (upper, middle) = (middle, lower);
        }
    }
}

/// Returns the sum of the products of three neighbours in a row and their weights.
#[inline(always)]
fn sum_of_products<S: Simd>(
    simd: S,
    [a, b, c]: [S::f32s; 3],
    [left, centre, right]: [S::f32s; 3],
) -> S::f32s {
    let sum = simd.mul_f32s(a, left);
    let sum = simd.mul_add_e_f32s(b, centre, sum);
    simd.mul_add_e_f32s(c, right, sum)
}

#[cfg(test)]
mod tests {
    use pulp::Scalar;

    use super::*;

    /// Returns a sum of the only channel at a pixel, computed one by one.
    fn sum(map: &Map, layer: &Convolution, x: usize, y: usize) -> f32 {
        let place = |k: usize, tap: usize| (k + tap * layer.dilation).checked_sub(layer.dilation);
        let pixel = |tap: usize| match (place(x, tap % 3), place(y, tap / 3)) {
            (Some(x), Some(y)) if x < map.columns && y < map.rows => map.at(0, x, y),
            _ => 0.0,
        };
        let products = layer.taps[0].iter().enumerate().map(|(tap, weight)| weight * pixel(tap));
        (layer.biases[0] + products.sum::<f32>()).max(0.0)
    }

    /// Checks the sums for a map of this size with every width of registers.
    fn check([rows, columns]: [usize; 2], dilation: usize) {
        let taps = [array::from_fn(|tap| (tap * 29 % 23) as f32 / 11.0 - 1.0)];
        let layer = Convolution { taps: taps.to_vec(), biases: vec![0.1], dilation };
        let mut map = Map::pattern([rows, columns], dilation, 1, 0);
        map.clear_border();
        let wide = layer.apply(&map);
        let mut single = Map::unset(rows, columns, dilation, 1);
        Scalar::new().vectorize(Sums { layer: &layer, map: &map, target: &mut single });
        for (x, y) in (0..rows * columns).map(|i| (i % columns, i / columns)) {
            let expected = sum(&map, &layer, x, y);
            for found in [&wide, &single].map(|sums| sums.at(0, x, y)) {
                assert!((found - expected).abs() < 1e-5, "{found} {expected} at {x}, {y}");
            }
        }
    }

    #[test]
    fn a_convolution_is_the_same_with_every_width_of_registers_and_rows() {
        for size in [[1, 1], [5, 3], [6, 15], [7, 16], [9, 37]] {
            [1, 2, 4].into_iter().for_each(|dilation| check(size, dilation));
        }
    }
}
