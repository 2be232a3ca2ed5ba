//! Layers of the networks.

use multiversion::multiversion;

use super::map::Map;
use super::mix::{Finish, Mix, positive};
use super::weights::Weights;

/// Pixels that a 3x3 convolution reads.
const TAPS: usize = 9;

/// A 3x3 convolution of each channel by itself and a mix, added to what was there.
struct Block {
    /// Nine weights for each channel, row by row.
    taps: Vec<[f32; TAPS]>,
    biases: Vec<f32>,
    /// Distance of the pixels that are read.
    dilation: usize,
    mix: Mix,
}

impl Block {
    /// Reads the weights of a block that reads neighbours at `dilation` pixels.
    fn new(channels: usize, dilation: usize, weights: &mut Weights) -> Self {
        let taps = weights.take(TAPS * channels).as_chunks().0.to_vec();
        let biases = weights.take(channels);
        Self { taps, biases, dilation, mix: Mix::new(channels, channels, weights) }
    }

    /// Replaces `map`, whose border is at least as wide as the dilation, by the outputs for it.
    fn apply(&self, map: &mut Map) {
        map.clear_border();
        let mut sums = Map::unset(map.rows, map.columns, map.border, map.channels());
        let (stride, width) = (map.stride(), map.width());
        let (start, span, dilation) = (map.start(), map.span(), self.dilation);
        let channels = map.values.chunks_exact(stride).zip(sums.values.chunks_exact_mut(stride));
        let weights = self.taps.iter().zip(&self.biases);
        for ((channel, sums), (taps, &bias)) in channels.zip(weights) {
            let first = start - dilation * (width + 1);
            let read = |tap| &channel[first + (tap / 3 * width + tap % 3) * dilation..][..span];
            convolve(std::array::from_fn(read), taps, bias, &mut sums[start..][..span]);
        }
        self.mix.add_rectified(&sums, map);
    }
}

/// Convolves the pixels that the taps read from each place on, adds `bias`, and sets negative sums
/// to 0.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn convolve(reads: [&[f32]; TAPS], taps: &[f32; TAPS], bias: f32, sums: &mut [f32]) {
    let count = sums.len();
    let [a, b, c, d, e, f, g, h, i] = reads.map(|read| &read[..count]);
    for (x, sum) in sums.iter_mut().enumerate() {
        let upper = taps[0] * a[x] + taps[1] * b[x] + taps[2] * c[x];
        let middle = taps[3] * d[x] + taps[4] * e[x] + taps[5] * f[x];
        let lower = taps[6] * g[x] + taps[7] * h[x] + taps[8] * i[x];
        *sum = positive(upper + middle + lower + bias);
    }
}

/// Layers that halve the size: they fold the map, mix its channels, and apply blocks.
pub(super) struct Stage {
    mix: Mix,
    blocks: Vec<Block>,
}

impl Stage {
    /// Reads the weights of a stage with a block of each of these `dilations`.
    pub(super) fn new(
        inputs: usize,
        outputs: usize,
        dilations: &[usize],
        weights: &mut Weights,
    ) -> Self {
        let mix = Mix::new(4 * inputs, outputs, weights);
        let block = |&dilation: &usize| Block::new(outputs, dilation, weights);
        Self { mix, blocks: dilations.iter().map(block).collect() }
    }

    /// Returns the outputs for `map`, whose rows and columns are even.
    pub(super) fn apply(&self, map: &Map) -> Map {
        let border = self.blocks.iter().map(|block| block.dilation).max().unwrap_or(0);
        let mut mixed = self.mix.apply(&map.folded(border), Finish::WriteRectified);
        self.blocks.iter().for_each(|block| block.apply(&mut mixed));
        mixed
    }
}
