//! Layers of the networks.

use std::cell::RefCell;
use std::mem;

use multiversion::multiversion;
use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, DVectorView};

use super::weights::Weights;

/// Pixels that a 3x3 convolution reads.
const TAPS: usize = 9;

/// Largest number of maps whose memory is kept: of all layers, for the sizes of a few windows.
const MAX_FREE: usize = 100;

thread_local! {
    /// Memory of maps that are no longer used: new memory would cost more than the layers.
    static FREE: RefCell<Vec<Vec<f32>>> = const { RefCell::new(Vec::new()) };
}

/// A picture of several channels.
#[derive(Debug, PartialEq)]
pub(in super::super) struct Map {
    pub(in super::super) rows: usize,
    pub(in super::super) columns: usize,
    /// The channels, each with its pixels row by row.
    pub(in super::super) values: Vec<f32>,
}

impl Drop for Map {
    fn drop(&mut self) {
        let values = mem::take(&mut self.values);
        FREE.with_borrow_mut(|free| {
            if free.len() == MAX_FREE {
                free.clear();
            }
            free.push(values);
        });
    }
}

impl Map {
    /// Makes a map of zeros.
    pub(in super::super) fn zeros(rows: usize, columns: usize, channels: usize) -> Self {
        let mut map = Self::unset(rows, columns, channels);
        map.values.fill(0.0);
        map
    }

    /// Makes a map of any values, which the caller replaces.
    fn unset(rows: usize, columns: usize, channels: usize) -> Self {
        let count = rows * columns * channels;
        // Memory of another size would have to be set first.
        let values = FREE.with_borrow_mut(|free| {
            let place = free.iter().rposition(|values| values.len() == count)?;
            Some(free.swap_remove(place))
        });
        Self { rows, columns, values: values.unwrap_or_else(|| vec![0.0; count]) }
    }

    /// Returns the number of channels.
    fn channels(&self) -> usize {
        self.values.len() / (self.rows * self.columns)
    }

    /// Returns the pixels of a channel, row by row.
    #[inline]
    pub(in super::super) fn channel(&self, channel: usize) -> &[f32] {
        let pixels = self.rows * self.columns;
        &self.values[channel * pixels..(channel + 1) * pixels]
    }

    /// Returns the pixels of a channel, row by row, to be changed.
    #[inline]
    pub(in super::super) fn channel_mut(&mut self, channel: usize) -> &mut [f32] {
        let pixels = self.rows * self.columns;
        &mut self.values[channel * pixels..(channel + 1) * pixels]
    }

    /// Returns the pixels of the first `N` channels, to be changed; of a missing channel none.
    pub(in super::super) fn channels_mut<const N: usize>(&mut self) -> [&mut [f32]; N] {
        let mut channels = self.values.chunks_exact_mut(self.rows * self.columns);
        std::array::from_fn(|_| channels.next().unwrap_or_default())
    }

    /// Mirrors the map: left becomes right.
    pub(in super::super) fn mirror(&mut self) {
        self.values.chunks_exact_mut(self.columns).for_each(<[f32]>::reverse);
    }

    /// Returns the map at half the size, with four channels for each of `self`: the pixels of each
    /// square of 2x2, row by row.
    pub(super) fn folded(&self) -> Self {
        let (rows, columns) = (self.rows / 2, self.columns / 2);
        let mut folded = Self::unset(rows, columns, 4 * self.channels());
        let targets = folded.values.chunks_exact_mut(2 * rows * columns);
        for (half, target) in targets.enumerate() {
            let (source, dy) = (self.channel(half / 2), half % 2);
            let lines = source.chunks_exact(self.columns).skip(dy).step_by(2);
            let (even, odd) = target.split_at_mut(rows * columns);
            let halves = even.chunks_exact_mut(columns).zip(odd.chunks_exact_mut(columns));
            lines.zip(halves).for_each(|(line, (even, odd))| split(line, even, odd));
        }
        folded
    }
}

/// Splits a line of pixels in the even and the odd ones.
#[multiversion(targets("x86_64+avx2"))]
fn split(line: &[f32], even: &mut [f32], odd: &mut [f32]) {
    let pairs = line.as_chunks::<2>().0.iter();
    for (pair, (even, odd)) in pairs.zip(even.iter_mut().zip(odd)) {
        (*even, *odd) = (pair[0], pair[1]);
    }
}

/// Returns `value`, or 0 if it is negative.
#[inline]
fn positive(value: f32) -> f32 {
    if value > 0.0 { value } else { 0.0 }
}

/// A layer that mixes the channels of each pixel.
pub(super) struct Mix {
    /// A row for each input, a column for each output.
    weights: DMatrix<f32>,
    biases: Vec<f32>,
}

impl Mix {
    /// Reads the weights of a layer.
    pub(super) fn new(inputs: usize, outputs: usize, weights: &mut Weights) -> Self {
        let matrix = DMatrix::from_vec(inputs, outputs, weights.take(inputs * outputs));
        Self { weights: matrix, biases: weights.take(outputs) }
    }

    /// Returns the sums for `map`.
    pub(super) fn apply(&self, map: &Map) -> Map {
        let mut sums = self.products(map);
        for (channel, &bias) in self.biases.iter().enumerate() {
            sums.channel_mut(channel).iter_mut().for_each(|sum| *sum += bias);
        }
        sums
    }

    /// Returns the sums for a single pixel with the channels `values`.
    ///
    /// The product of a row and a matrix takes many times as long.
    pub(super) fn apply_to_pixel(&self, values: &[f32]) -> Vec<f32> {
        let values = DVectorView::from_slice(values, values.len());
        let columns = self.weights.column_iter().zip(&self.biases);
        columns.map(|(column, bias)| column.dot(&values) + bias).collect()
    }

    /// Returns the sums for `map`, negative ones as 0.
    fn rectified(&self, map: &Map) -> Map {
        let mut sums = self.products(map);
        for (channel, &bias) in self.biases.iter().enumerate() {
            rectify(sums.channel_mut(channel), bias);
        }
        sums
    }

    /// Adds the sums for `map` to `total`, negative ones as 0.
    fn add_rectified(&self, map: &Map, total: &mut Map) {
        let sums = self.products(map);
        for (channel, &bias) in self.biases.iter().enumerate() {
            add_rectified(sums.channel(channel), bias, total.channel_mut(channel));
        }
    }

    /// Returns the sums for `map`, without the biases.
    fn products(&self, map: &Map) -> Map {
        let (pixels, outputs) = (map.rows * map.columns, self.biases.len());
        let mut sums = Map::unset(map.rows, map.columns, outputs);
        let values = DMatrixView::from_slice(&map.values, pixels, map.channels());
        let mut products = DMatrixViewMut::from_slice(&mut sums.values, pixels, outputs);
        products.gemm(1.0, &values, &self.weights, 0.0);
        sums
    }
}

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

    /// Returns the outputs for `map`.
    fn apply(&self, mut map: Map) -> Map {
        let mut convolved = Map::unset(map.rows, map.columns, map.channels());
        let border = self.dilation;
        // A channel with a border of zeros, and its sums: rows of the same length, so that one loop
        // does them all.
        let mut padded = Map::zeros(map.rows + 2 * border, map.columns + 2 * border, 1);
        let width = padded.columns;
        let mut sums = Map::unset(map.rows, width, 1);
        for channel in 0..map.channels() {
            let inner = padded.values.chunks_exact_mut(width).skip(border);
            for (row, line) in inner.zip(map.channel(channel).chunks_exact(map.columns)) {
                row[border..][..map.columns].copy_from_slice(line);
            }
            let read = |tap: usize| &padded.values[(tap / 3 * width + tap % 3) * border..];
            let reads = std::array::from_fn(read);
            convolve(reads, &self.taps[channel], self.biases[channel], &mut sums.values);
            let rows = convolved.channel_mut(channel).chunks_exact_mut(map.columns);
            for (row, line) in rows.zip(sums.values.chunks_exact(width)) {
                row.copy_from_slice(&line[..row.len()]);
            }
        }
        self.mix.add_rectified(&convolved, &mut map);
        map
    }
}

/// Convolves the pixels that the taps read from each place on, adds `bias`, and sets negative sums
/// to 0. The last places, which some taps have no pixels for, are left out: they are in the border.
#[multiversion(targets("x86_64+avx2"))]
fn convolve(reads: [&[f32]; TAPS], taps: &[f32; TAPS], bias: f32, sums: &mut [f32]) {
    let count = reads.iter().map(|read| read.len()).fold(sums.len(), usize::min);
    let [a, b, c, d, e, f, g, h, i] = reads.map(|read| &read[..count]);
    for (x, sum) in sums[..count].iter_mut().enumerate() {
        let upper = taps[0] * a[x] + taps[1] * b[x] + taps[2] * c[x];
        let middle = taps[3] * d[x] + taps[4] * e[x] + taps[5] * f[x];
        let lower = taps[6] * g[x] + taps[7] * h[x] + taps[8] * i[x];
        *sum = positive(upper + middle + lower + bias);
    }
}

/// Adds `bias` to `values` and sets negative sums to 0.
#[multiversion(targets("x86_64+avx2"))]
fn rectify(values: &mut [f32], bias: f32) {
    values.iter_mut().for_each(|value| *value = positive(*value + bias));
}

/// Adds `values` and `bias` to `total` where their sum is positive.
#[multiversion(targets("x86_64+avx2"))]
fn add_rectified(values: &[f32], bias: f32, total: &mut [f32]) {
    let pairs = total.iter_mut().zip(values);
    pairs.for_each(|(total, value)| *total += positive(value + bias));
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
        let mixed = self.mix.rectified(&map.folded());
        self.blocks.iter().fold(mixed, |map, block| block.apply(map))
    }
}
