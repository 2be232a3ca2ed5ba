//! The two small networks: one proposes places in a picture, the other judges a disc.
//!
//! Both fold squares of 2x2 pixels into channels, mix the channels of each pixel ([`mix`]), and
//! convolve each channel by itself ([`layers`]), in f32. `scripts/detector` trains them and writes
//! their weights to one file ([`Networks::get`]).

mod judge;
mod layers;
mod map;
mod mix;
mod proposer;
#[cfg(test)]
mod tests;
mod weights;

use std::sync::LazyLock;

pub(super) use judge::{Judge, Judgement, PATCH, PATCH_RADIUS};
pub(super) use map::Map;
pub(super) use proposer::{CELL, Proposer, RADIUS_UNIT};
use weights::Weights;

/// Number of channels that both networks read: red, green, blue, a depth, and whether it is known.
pub(super) const CHANNELS: usize = 5;

/// Both networks with their weights.
pub(super) struct Networks {
    pub(super) proposer: Proposer,
    pub(super) judge: Judge,
}

/// The weights file.
const FILE: &[u8] = include_bytes!("weights.bin");

/// The networks of the weights file.
static NETWORKS: LazyLock<Networks> = LazyLock::new(|| {
    let mut weights = Weights::new(FILE);
    let networks =
        Networks { proposer: Proposer::new(&mut weights), judge: Judge::new(&mut weights) };
    weights.finish();
    networks
});

impl Networks {
    /// Returns the networks of the weights file.
    pub(super) fn get() -> &'static Self {
        &NETWORKS
    }
}
