//! What is beside a disc, ray by ray.

use super::judge::Judge;
use super::outline::{Outline, Rim};
use super::rays::RAYS;

/// Where the depth outside a disc is read, in its radius and in pixels more: beyond the pixels that
/// mix ball and background, and beyond what depth may be shifted against colour.
const OUTSIDE: (f64, f64) = (1.4, 2.0);
/// What has so much of the ball's colour at least goes on beside it.
const SAME: f32 = 0.25;
/// What is no farther behind the ball's centre is beside it, in its radius.
const BESIDE: f64 = 0.4;
/// What is so much nearer than the ball's centre covers it, in its radius: what is of another
/// colour, and anything.
const COVER: (f64, f64) = (1.2, 2.5);

/// What is beside a disc at the end of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// The ball itself ends there: redness drops, and what is there is little behind it or has no
    /// depth.
    Free,
    /// The ball itself ends there: what is there is behind it, with an edge or not.
    Behind,
    /// No edge, and no depth or little difference of it.
    Open,
    /// Something as near as the ball's surface (a print on a box has the box around it), or red and
    /// nearer.
    Attached,
    /// The same, and of the ball's colour: a can's lower half.
    Continued,
    /// Something else, nearer.
    Covered,
    /// The same, but of the ball's colour beside the disc.
    CoveredAlike,
}

/// What is around a disc, ray by ray; `None` out of the picture.
pub(super) struct Around {
    sides: [Option<Side>; RAYS],
}

impl Around {
    /// Part of the rays within the picture (taken to be a quarter at least: a sliver of a ball is
    /// none) that show `side`.
    pub(super) fn part(&self, side: Side) -> f64 {
        self.sides.iter().filter(|&&s| s == Some(side)).count() as f64 / self.seen()
    }

    /// Part of the rays on which something nearer hides where the ball ends.
    pub(super) fn covered(&self) -> f64 {
        self.part(Side::Covered) + self.part(Side::CoveredAlike)
    }

    /// Part of the rays on which the ball's colour goes on and nothing else says that it ends.
    pub(super) fn goes_on(&self, outline: &Outline) -> f64 {
        let rays = self.sides.iter().zip(outline.rims);
        rays.filter(|(side, rim)| **side == Some(Side::Open) && *rim == Rim::Red).count() as f64
            / self.seen()
    }

    /// The rays whose edges are the ball's own as far as depth says so.
    pub(super) fn trusted(&self) -> [bool; RAYS] {
        self.sides.map(|side| {
            !matches!(
                side,
                Some(Side::Covered | Side::CoveredAlike | Side::Attached | Side::Continued)
            )
        })
    }

    /// How many rays are within the picture, a quarter of all at least.
    pub(super) fn seen(&self) -> f64 {
        self.sides.iter().flatten().count().max(RAYS / 4) as f64
    }
}

impl Judge<'_> {
    /// What is around a ball at depth `z`.
    pub(super) fn around(&self, outline: &Outline, z: f64) -> Around {
        let rays = self.picture.rays(&outline.disc);
        let side = |ray: usize| {
            if outline.rims[ray] == Rim::Unseen {
                return None;
            }
            let depth_at = |pixel: Option<(f64, f64)>| pixel.and_then(|(u, v)| self.depth.at(u, v));
            let pixel = rays.at(ray, OUTSIDE.0 * outline.disc.radius + OUTSIDE.1);
            let alike = pixel.is_some_and(|(u, v)| self.picture.likeness(u, v) > SAME);
            let covered = if alike { Side::CoveredAlike } else { Side::Covered };
            // A post may end before the place beside it.
            let rim = depth_at(rays.at(ray, outline.disc.radius));
            if rim.is_some_and(|o| o <= z - COVER.0 * self.ball_radius) {
                return Some(covered);
            }
            Some(match depth_at(pixel) {
                Some(o) if o <= z - COVER.1 * self.ball_radius => covered,
                Some(o) if o <= z && outline.rims[ray] == Rim::Red => Side::Continued,
                Some(o) if o <= z - COVER.0 * self.ball_radius => covered,
                Some(o) if o <= z + BESIDE * self.ball_radius => {
                    if alike {
                        Side::Continued
                    } else {
                        Side::Attached
                    }
                }
                Some(o) if o > z + self.ball_radius => Side::Behind,
                _ if outline.rims[ray] == Rim::Edge => Side::Free,
                _ => Side::Open,
            })
        };
        Around { sides: std::array::from_fn(side) }
    }
}
