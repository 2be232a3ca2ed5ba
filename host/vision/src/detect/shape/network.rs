//! The three small networks: the proposer proposes places in a picture, the screen judges each of
//! these places, and the judge, a larger one, the circles that are fitted there.
//!
//! All fold squares of 2x2 pixels into channels, mix the channels of each pixel ([`mix`]), and
//! convolve each channel by itself ([`convolve`]), in f32. `scripts/detector` trains them and
//! writes their weights to one file ([`Networks::get`]).

mod convolve;
mod judge;
mod layers;
mod map;
mod mix;
#[cfg(test)]
mod tests;
mod weights;

use std::sync::LazyLock;

use weights::Weights;

pub(super) use judge::{CELL, Judge, Judgement, PATCH, PATCH_RADIUS, Proposer, RADIUS_UNIT};
pub(super) use map::Map;

/// The networks with their weights.
pub(super) struct Networks {
    pub(super) proposer: Proposer,
    /// Judges the proposals: many, so it is small.
    pub(super) screen: Judge,
    /// Judges the refined circles: few.
    pub(super) judge: Judge,
}

/// Channels of the screen and of the judge, at half the size of a patch and at a quarter.
const SCREEN: [usize; 2] = [24, 64];
const JUDGE: [usize; 2] = [48, 128];

/// The weights file.
const FILE: &[u8] = include_bytes!("network/weights.bin");

/// The networks of the weights file.
static NETWORKS: LazyLock<Networks> = LazyLock::new(|| {
    let mut weights = Weights::new(FILE);
    let proposer = Proposer::new(&mut weights);
    let screen = Judge::new(SCREEN, &mut weights);
    let judge = Judge::new(JUDGE, &mut weights);
    weights.finish();
    Networks { proposer, screen, judge }
});

impl Networks {
    /// Returns the networks of the weights file.
    pub(super) fn get() -> &'static Self {
        &NETWORKS
    }
}
