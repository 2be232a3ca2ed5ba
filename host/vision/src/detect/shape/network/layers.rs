//! Layers of the networks.

use super::convolve::Convolution;
use super::map::Map;
use super::mix::{Finish, Mix};
use super::weights::Weights;

/// A 3x3 convolution of each channel by itself and a mix, added to what was there.
struct Block {
    convolution: Convolution,
    mix: Mix,
}

impl Block {
    /// Reads the weights of a block that reads neighbours at `dilation` pixels.
    fn new(channels: usize, dilation: usize, weights: &mut Weights) -> Self {
        let convolution = Convolution::new(channels, dilation, weights);
        Self { convolution, mix: Mix::new(channels, channels, weights) }
    }

    /// Replaces `map`, whose border is at least as wide as the dilation, by the outputs for it.
    fn apply(&self, map: &mut Map) {
        map.clear_border();
        self.mix.add_rectified(&self.convolution.apply(map), map);
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
        let border =
            self.blocks.iter().map(|block| block.convolution.dilation()).max().unwrap_or(0);
        let mut mixed = self.mix.apply(&map.folded(border), Finish::WriteRectified);
        self.blocks.iter().for_each(|block| block.apply(&mut mixed));
        mixed
    }
}
