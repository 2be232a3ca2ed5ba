//! Depth on a disc: where the ball's centre is, and what hides it.

use super::view::{Disc, FrameView};
use crate::localise::{CentreDepth, rough_centre_depth};
use crate::observation::Circle;

/// Spacing of the places on a disc that are read, in its radius.
const SPACING: f64 = 0.22;
/// Square of the largest distance of those places from the centre, in the radius: leaves out the
/// disc's limb.
const MAX_SQUARE: f64 = 0.8;

/// A place on a disc, in its radius, from its centre.
#[derive(Debug, Clone, Copy)]
pub(super) struct DiscPlace {
    pub(super) x: f64,
    pub(super) y: f64,
}

impl DiscPlace {
    /// Returns the square of the distance from the centre, in the radius.
    #[inline]
    pub(super) fn square(&self) -> f64 {
        self.x * self.x + self.y * self.y
    }

    /// Returns column and row of the place on `disc`.
    #[inline]
    pub(super) fn on(&self, disc: &Disc) -> (f64, f64) {
        (disc.u + self.x * disc.radius, disc.v + self.y * disc.radius)
    }
}

/// Returns places spread over a disc but for its limb.
pub(super) fn places() -> impl Iterator<Item = DiscPlace> {
    let all = (-4..=4).flat_map(|j| (-4..=4).map(move |i| (f64::from(i), f64::from(j))));
    let places = all.map(|(x, y)| DiscPlace { x: x * SPACING, y: y * SPACING });
    places.filter(|place| place.square() < MAX_SQUARE)
}

impl FrameView<'_> {
    /// Returns the depth of the ball's centre, metres, if enough of the visible disc agrees on it.
    ///
    /// Pixels of the ball's colour come first: a post in front of the ball may hide more of the
    /// disc than is visible of the ball.
    pub(super) fn centre_depth(&self, disc: &Disc) -> Option<f64> {
        let least = self.parameters.clusters.min_likeness;
        let coloured = self.agreed_depth(disc, |u, v| self.colour.likeness(u, v) >= least);
        coloured.or_else(|| self.agreed_depth(disc, |_, _| true))
    }

    /// Returns the depth of the ball's centre, metres, if enough of the visible disc agrees on it.
    /// Only pixels that `counts` accepts are read.
    fn agreed_depth(&self, disc: &Disc, counts: impl Fn(f64, f64) -> bool) -> Option<f64> {
        let parameters = &self.parameters.decide;
        let circle = Circle::rough(disc.u, disc.v, disc.radius);
        let CentreDepth { depth, support, .. } =
            rough_centre_depth(&circle, &self.depth, self.ball_radius, counts)?;
        let visible = (1.0 - self.covered_part(disc, depth)).max(parameters.min_visible);
        (support >= parameters.min_depth_support * visible).then_some(depth)
    }

    /// Returns the part of a disc that is hidden by objects in front of a ball at depth `z`.
    pub(super) fn covered_part(&self, disc: &Disc, z: f64) -> f64 {
        self.part(disc, places(), |depth| self.is_in_front(depth, z))
    }

    /// Returns the part of these places on a disc whose depth passes `test`.
    pub(super) fn part(
        &self,
        disc: &Disc,
        places: impl Iterator<Item = DiscPlace>,
        test: impl Fn(f64) -> bool,
    ) -> f64 {
        let (mut found, mut all) = (0, 0);
        for place in places {
            all += 1;
            let (u, v) = place.on(disc);
            found += usize::from(self.depth.at(u, v).is_some_and(&test));
        }
        found as f64 / f64::from(all)
    }

    /// Checks whether an object at depth `depth` is in front of a ball at depth `z`, metres.
    #[inline]
    pub(super) fn is_in_front(&self, depth: f64, z: f64) -> bool {
        depth < z - self.parameters.decide.covers_disc * self.ball_radius
    }
}
