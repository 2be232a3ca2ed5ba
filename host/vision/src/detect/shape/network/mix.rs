//! Layers that mix channels: products of matrices.
//!
//! A product computes so many sums at a time that all of them stay in the registers of the
//! processor, and reads the pixels where they are. A library's product would rearrange them first,
//! which takes as long as the product of so small matrices.

use pulp::{Arch, Simd, WithSimd};

use super::map::{LONG_STEP, Map};
use super::weights::Weights;

/// Outputs of a tile: the largest number that is computed at a time.
const OUTPUTS: usize = 8;

/// What a layer does with its sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Finish {
    /// Writes them.
    Write,
    /// Writes them, negative ones as 0.
    WriteRectified,
    /// Adds them, negative ones as 0.
    AddRectified,
}

/// The weights of a few outputs.
struct Tile {
    biases: [f32; OUTPUTS],
    /// The weights of each input.
    weights: Vec<[f32; OUTPUTS]>,
}

/// A layer that mixes the channels of each pixel.
pub(super) struct Mix {
    tiles: Vec<Tile>,
}

impl Mix {
    /// Reads the weights of a layer; `outputs` is a multiple of 8.
    pub(super) fn new(inputs: usize, outputs: usize, weights: &mut Weights) -> Self {
        let rows = weights.take(inputs * outputs);
        let biases = weights.take(outputs);
        let tiles = rows.chunks_exact(OUTPUTS * inputs).zip(biases.as_chunks().0);
        let tile = |(rows, &biases): (&[f32], _)| {
            let of_input = |k| std::array::from_fn(|output| rows[output * inputs + k]);
            Tile { biases, weights: (0..inputs).map(of_input).collect() }
        };
        Self { tiles: tiles.map(tile).collect() }
    }

    /// Returns the number of outputs.
    pub(super) fn outputs(&self) -> usize {
        OUTPUTS * self.tiles.len()
    }

    /// Returns the sums for `map`; the border has any finite values.
    pub(super) fn apply(&self, map: &Map, finish: Finish) -> Map {
        let mut sums = Map::unset(map.rows, map.columns, map.border, self.outputs());
        let product = Product { map, tiles: &self.tiles, finish, target: &mut sums };
        Arch::new().dispatch(product);
        sums
    }

    /// Adds the sums for `map` to `total`, negative ones as 0; the border gets any finite values.
    pub(super) fn add_rectified(&self, map: &Map, total: &mut Map) {
        let (tiles, finish) = (&self.tiles, Finish::AddRectified);
        Arch::new().dispatch(Product { map, tiles, finish, target: total });
    }
}

/// The product of a map and the weights of a layer.
struct Product<'a> {
    map: &'a Map,
    tiles: &'a [Tile],
    finish: Finish,
    /// A map of the same size.
    target: &'a mut Map,
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // The sums, the pixels and a weight fit the registers. With more sums each number that is
        // read is used more often.
        match (S::REGISTER_COUNT < 32, self.map.span().is_multiple_of(LONG_STEP)) {
            (true, true) => self.compute::<S, { OUTPUTS / 2 }, 3>(simd),
            (true, false) => self.compute::<S, { OUTPUTS / 2 }, 2>(simd),
            (false, true) => self.compute::<S, OUTPUTS, 3>(simd),
            (false, false) => self.compute::<S, OUTPUTS, 2>(simd),
        }
    }
}

impl Product<'_> {
    /// Computes the product, `SUMS` outputs and `VECTORS` registers of pixels at a time.
    #[inline(always)]
    fn compute<S: Simd, const SUMS: usize, const VECTORS: usize>(self, simd: S) {
        let Self { map, tiles, finish, target } = self;
        let (stride, step) = (map.stride(), VECTORS * S::F32_LANES);
        let zero = simd.splat_f32s(0.0);
        for first in (map.start()..map.start() + map.span()).step_by(step) {
            let targets = target.values.chunks_exact_mut(SUMS * stride);
            for (i, targets) in targets.enumerate() {
                let (tile, part) = (&tiles[i * SUMS / OUTPUTS], i % (OUTPUTS / SUMS));
                let biases = tile.biases.as_chunks::<SUMS>().0[part];
                let mut sums = biases.map(|bias| [simd.splat_f32s(bias); VECTORS]);
                for (channel, weights) in map.values.chunks_exact(stride).zip(&tile.weights) {
                    let pixels = S::as_simd_f32s(&channel[first..first + step]).0;
                    let weights = weights.as_chunks::<SUMS>().0[part];
                    for (sums, weight) in sums.iter_mut().zip(weights) {
                        let weight = simd.splat_f32s(weight);
                        for (sum, &pixels) in sums.iter_mut().zip(pixels) {
                            *sum = simd.mul_add_e_f32s(pixels, weight, *sum);
                        }
                    }
                }
                for (sums, target) in sums.iter().zip(targets.chunks_exact_mut(stride)) {
                    let places = S::as_mut_simd_f32s(&mut target[first..first + step]).0;
                    for (place, &sum) in places.iter_mut().zip(sums) {
                        *place = match finish {
                            Finish::Write => sum,
                            Finish::WriteRectified => simd.max_f32s(sum, zero),
                            Finish::AddRectified => simd.add_f32s(*place, simd.max_f32s(sum, zero)),
                        };
                    }
                }
            }
        }
    }
}

/// A layer whose outputs are sums of all pixels of a map.
pub(super) struct Dense {
    /// The weights of each output.
    weights: Vec<Vec<f32>>,
    biases: Vec<f32>,
}

impl Dense {
    /// Reads the weights of a layer.
    pub(super) fn new(inputs: usize, outputs: usize, weights: &mut Weights) -> Self {
        let rows = weights.take(inputs * outputs);
        let rows = rows.chunks_exact(inputs).map(<[f32]>::to_vec).collect();
        Self { weights: rows, biases: weights.take(outputs) }
    }

    /// Returns the sums for `map`.
    pub(super) fn apply(&self, map: &Map) -> Vec<f32> {
        let mut pixels = Vec::with_capacity(map.channels() * map.rows * map.columns);
        let rows = (0..map.channels()).flat_map(|channel| map.rows_of(channel));
        rows.for_each(|row| pixels.extend_from_slice(row));
        let rows = self.weights.iter().zip(&self.biases);
        rows.map(|(weights, bias)| Arch::new().dispatch(Dot(weights, &pixels)) + bias).collect()
    }
}

/// The sum of the products of two lists of numbers.
struct Dot<'a>(&'a [f32], &'a [f32]);

impl WithSimd for Dot<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        let (a, b) = (S::as_simd_f32s(self.0), S::as_simd_f32s(self.1));
        let zero = simd.splat_f32s(0.0);
        let products = a.0.iter().zip(b.0);
        let sums = products.fold(zero, |sums, (&a, &b)| simd.mul_add_e_f32s(a, b, sums));
        let rest: f32 = a.1.iter().zip(b.1).map(|(a, b)| a * b).sum();
        simd.reduce_sum_f32s(sums) + rest
    }
}

#[cfg(test)]
mod tests {
    use pulp::Scalar;

    use super::*;

    const INPUTS: usize = 3;

    /// Returns a map of numbers between -1 and 1 with this border.
    fn pattern(border: usize, channels: usize, seed: usize) -> Map {
        Map::pattern([5, 7], border, channels, seed)
    }

    /// Returns a layer of eight outputs.
    fn layer() -> Mix {
        let numbers = (0..8 * INPUTS + 8).map(|i| (i * 29 % 23) as f32 / 11.0 - 1.0);
        let bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
        Mix::new(INPUTS, 8, &mut Weights::new(&[b"weights\n\n", bytes.as_slice()].concat()))
    }

    /// Returns the sum of an output at a pixel, computed one by one.
    fn sum(map: &Map, layer: &Mix, output: usize, x: usize, y: usize) -> f32 {
        let (tile, k) = (&layer.tiles[output / OUTPUTS], output % OUTPUTS);
        let products = (0..INPUTS).map(|input| map.at(input, x, y) * tile.weights[input][k]);
        tile.biases[k] + products.sum::<f32>()
    }

    #[test]
    fn a_product_is_the_same_with_every_width_of_registers_and_border() {
        for border in [0, 1, 4] {
            for finish in [Finish::Write, Finish::WriteRectified, Finish::AddRectified] {
                let (map, layer) = (pattern(border, INPUTS, 0), layer());
                let before = pattern(border, 8, 5);
                let tiles = &layer.tiles;
                let [mut wide, mut single] = [pattern(border, 8, 5), pattern(border, 8, 5)];
                Arch::new().dispatch(Product { map: &map, tiles, finish, target: &mut wide });
                let product = Product { map: &map, tiles, finish, target: &mut single };
                Scalar::new().vectorize(product);
                for (output, y, x) in (0..8 * 5 * 7).map(|i| (i / 35, i / 7 % 5, i % 7)) {
                    let sum = sum(&map, &layer, output, x, y);
                    let expected = match finish {
                        Finish::Write => sum,
                        Finish::WriteRectified => sum.max(0.0),
                        Finish::AddRectified => before.at(output, x, y) + sum.max(0.0),
                    };
                    for found in [&wide, &single].map(|result| result.at(output, x, y)) {
                        assert!((found - expected).abs() < 1e-5, "{found} {expected} {finish:?}");
                    }
                }
            }
        }
    }
}
