//! The proposer.

use super::CHANNELS;
use super::layers::Stage;
use super::map::Map;
use super::mix::{Finish, Mix};
use super::weights::Weights;

/// Input pixels in a cell of the output, in either direction.
pub(in super::super) const CELL: usize = 2;
/// Unit of the radius that the network tells, input pixels.
pub(in super::super) const RADIUS_UNIT: f64 = 5.0;

/// The network that proposes places in a picture: the proposer.
pub(in super::super) struct Proposer {
    fine: Stage,
    coarse: Stage,
    head: Mix,
}

impl Proposer {
    /// Reads the weights.
    pub(super) fn new(weights: &mut Weights) -> Self {
        Self {
            fine: Stage::new(CHANNELS, 16, &[1], weights),
            coarse: Stage::new(16, 40, &[1, 2, 4, 2], weights),
            head: Mix::new(40, 16, weights),
        }
    }

    /// Returns, at a quarter of the size of `input`, four channels of 2x2 cells each, row by row:
    /// the log-odds that the ball's centre is in the cell, the offset of the centre from the cell's
    /// to the right and down (in cells), and the logarithm of its radius over [`RADIUS_UNIT`].
    ///
    /// Columns and rows of `input` are multiples of 4.
    pub(in super::super) fn apply(&self, input: &Map) -> Map {
        self.head.apply(&self.coarse.apply(&self.fine.apply(input)), Finish::Write)
    }
}
