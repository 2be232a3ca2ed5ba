//! The networks: the proposer, which reads a picture, and the screen and the judge, which judge a
//! disc.

use super::super::view::Disc;
use super::layers::Stage;
use super::map::{CHANNELS, Map};
use super::mix::{Dense, Finish, Mix};
use super::weights::Weights;
use crate::detect::shape::view::Stretch;

/// Columns and rows of a patch.
pub(in super::super) const PATCH: usize = 24;
/// Radius of the disc in a patch, pixels.
pub(in super::super) const PATCH_RADIUS: f64 = 7.0;

/// Judgement of a disc by a network.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Judgement {
    /// Log-odds that the disc is the ball.
    pub(in super::super) log_odds: f64,
    /// Where the ball's centre is on the disc, to the right of its centre and down, in its radius.
    pub(in super::super) offset: (f64, f64),
    /// Logarithm of the ball's radius over the disc's.
    pub(in super::super) growth: f64,
}

impl Judgement {
    /// Returns the ball's disc as seen from `disc`, the one that was judged.
    pub(in super::super) fn moved(&self, disc: &Disc, stretch: &Stretch) -> Disc {
        let (right, down) = self.offset;
        let (u, v) = stretch.at(disc, right * disc.radius, down * disc.radius);
        Disc { u, v, radius: disc.radius * self.growth.exp() }
    }

    /// Returns the mean of `self` and of what the network says about the mirrored patch.
    pub(in super::super) fn mean(&self, mirrored: &Self) -> Self {
        Self {
            log_odds: self.log_odds.midpoint(mirrored.log_odds),
            offset: (
                self.offset.0.midpoint(-mirrored.offset.0),
                self.offset.1.midpoint(mirrored.offset.1),
            ),
            growth: self.growth.midpoint(mirrored.growth),
        }
    }
}

/// A network that judges a disc by the patch about it.
pub(in super::super) struct Judge {
    fine: Stage,
    coarse: Stage,
    head: Dense,
}

impl Judge {
    /// Reads the weights of a network with these numbers of channels at half the size of the patch
    /// and at a quarter of it.
    pub(super) fn new([fine, coarse]: [usize; 2], weights: &mut Weights) -> Self {
        Self {
            fine: Stage::new(CHANNELS, fine, &[1], weights),
            coarse: Stage::new(fine, coarse, &[1, 1], weights),
            head: Dense::new(PATCH / 4 * (PATCH / 4) * coarse, 4, weights),
        }
    }

    /// Judges the disc in the middle of `patch`.
    pub(in super::super) fn apply(&self, patch: &Map) -> Judgement {
        let map = self.coarse.apply(&self.fine.apply(patch));
        let head = self.head.apply(&map);
        let value = |k: usize| f64::from(head[k]);
        Judgement { log_odds: value(0), offset: (value(1), value(2)), growth: value(3) }
    }
}

/// Input pixels in a cell of the output, in either direction.
pub(in crate::detect::shape) const CELL: usize = 2;
/// Unit of the radius that the network tells, input pixels.
pub(in crate::detect::shape) const RADIUS_UNIT: f64 = 5.0;

/// The network that proposes places in a picture: the proposer.
pub(in crate::detect::shape) struct Proposer {
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
    pub(in crate::detect::shape) fn apply(&self, input: &Map) -> Map {
        self.head.apply(&self.coarse.apply(&self.fine.apply(input)), Finish::Write)
    }
}
