//! Depth on a disc: where the ball's centre is, and what hides it. The patch about a disc, brought
//! to one size, is the input of the screen and of the judge.

use std::array;
use std::ops::Range;

use super::network::{Judgement, Map, Networks, PATCH, PATCH_RADIUS};
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

/// Largest depth against the ball's centre that a patch shows, in the ball's radius.
const MAX_BEHIND: f64 = 3.0;

/// Judges `disc` by the screen.
pub(in crate::detect::shape) fn screen(view: &FrameView, disc: &Disc) -> Judgement {
    Networks::get().screen.apply(&patch(view, disc))
}

/// Returns the log-odds by the judge that `disc` is the ball.
pub(super) fn log_odds(view: &FrameView, disc: &Disc) -> f64 {
    Networks::get().judge.apply(&patch(view, disc)).log_odds
}

/// Judges `disc` by the judge. If its log-odds are in the range `unsure`, the mirrored
/// patch is judged as well, and the mean is returned.
///
/// A ball looks the same in a mirror. The mean errs less than one judgement does: without depth
/// about 3 % more of the balls are found with as many false alarms.
pub(super) fn judge_mirrored(view: &FrameView, disc: &Disc, unsure: Range<f64>) -> Judgement {
    let judge = &Networks::get().judge;
    let mut patch = patch(view, disc);
    let judgement = judge.apply(&patch);
    if !unsure.contains(&judgement.log_odds) {
        return judgement;
    }
    patch.mirror();
    judgement.mean(&judge.apply(&patch))
}

/// Returns the patch about `disc`, in which a ball is round wherever in the image it is.
///
/// The channels are red, green and blue from -1 to 1, turned so that the ball's hue is red, the
/// depth behind the centre of a ball of this size (from -1 to 1; 0 where it is unknown), and
/// whether it is known. Without depth the last two are missing.
fn patch(view: &FrameView, disc: &Disc) -> Map {
    let mut patch = Map::input(PATCH, PATCH, view.has_depth);
    let turn = view.colour.ball().turn_to_red();
    let scale = disc.radius / PATCH_RADIUS;
    let level = &view.levels[(scale.log2().max(0.0) as usize).min(view.levels.len() - 1)];
    let rows = rows(view, disc, scale);
    let [reds, greens, blues, behinds, known] = patch.channels_mut();
    for (i, colour) in level.grid(rows).into_iter().enumerate() {
        [reds[i], greens[i], blues[i]] = turn.apply(colour).map(|value| value / 127.5 - 1.0);
    }
    if view.has_depth {
        read_depths(view, view.depth_of(disc), &rows, [behinds, known]);
    }
    patch
}

/// Returns the rows of the image that a patch about `disc` shows, each with its columns; pixels of
/// the patch are `scale` pixels of the disc's radius apart.
fn rows(view: &FrameView, disc: &Disc, scale: f64) -> [(f64, [f64; PATCH]); PATCH] {
    let stretch = view.stretch(disc);
    let place = |k: usize| (k as f64 - (PATCH - 1) as f64 / 2.0) * scale;
    array::from_fn(|y| {
        let columns = array::from_fn(|x| stretch.at(disc, place(x), place(y)).0);
        (stretch.at(disc, 0.0, place(y)).1, columns)
    })
}

/// Writes the depth behind `z` at the pixels nearest to the columns of the rows, and whether it is
/// known, to channels of zeros.
fn read_depths(
    view: &FrameView,
    z: f64,
    rows: &[(f64, [f64; PATCH]); PATCH],
    [behinds, known]: [&mut [f32]; 2],
) {
    let nearest = |k: f64| (k >= -0.5).then_some((k + 0.5) as usize);
    for (y, &(row, columns)) in rows.iter().enumerate() {
        let line = nearest(row).map(|row| view.depth.row(row)).unwrap_or_default();
        for (x, column) in columns.map(nearest).into_iter().enumerate() {
            let raw = column.and_then(|column| line.get(column)).copied().unwrap_or_default();
            if let Some(depth) = view.depth.metres(raw) {
                let behind = (depth - z) / view.ball_radius;
                behinds[y * PATCH + x] = (behind / MAX_BEHIND).clamp(-1.0, 1.0) as f32;
                known[y * PATCH + x] = 1.0;
            }
        }
    }
}
