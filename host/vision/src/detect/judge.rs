//! Whether an outline is a ball's: its shape, its size against depth, and what is around it.

use nalgebra::Matrix3;

use super::around::{Around, Side};
use super::edge::Fine;
use super::evidence::{Alone, Bare, Evidence, probability};
use super::outline::{Outline, Rim};
use super::picture::{Disc, Picture};
use super::rays::{RAYS, Rays};
use super::round::{FINELY, ROUGHLY, on_sphere, roundness};
use super::sphere::COLOURED;
use crate::localise::{CentreDepth, DepthView, rough_centre_depth};

/// Part of what is seen of the disc that must agree on its depth for it to be taken as known.
const KNOWN: f64 = 0.33;
/// Grey levels of noise that are no colour on a disc.
const NOISE: f32 = 12.0;
/// What is left of the score of a ball whose depth is not known.
const UNKNOWN: f64 = 0.9;
/// Part of the rays, and of those that nothing covers, on which more than this must end freely.
const FREE: (f64, f64) = (0.25, 0.4);
/// How far the edges may move a disc that depth has shown: in its radius, and pixels more.
const HELD: (f64, f64) = (0.12, 4.0);
/// A disc that was moved by more than this, in its radius, is fitted again; and one whose radius is
/// so much another than depth asks for where it is now.
const MOVED: (f64, f64) = (0.1, 0.025);
/// A surface no rounder than this is none of a ball, at a place that is not exact.
const FLAT_SURFACE: f64 = 0.1;
/// What has no better odds (their logarithm) before its outline is fitted is not fitted: with
/// depth, and without. Of 4213 places on balls with depth none had less than -4.3, and of 68
/// without none less than 1.5; of 18 380 and 2078 others four of five and half had less.
const NO_BALL: (f64, f64) = (-5.0, -2.0);
/// With less of the ball's colour than this a disc is none.
const PALE: f64 = 0.28;
/// Part of the rays that end in the picture if a ball is nearly whole.
const WHOLE: f64 = 0.8;
/// Of fewer it is a sliver, which may be of a larger ball: when its middle is a third of its radius
/// out of the picture.
const SLIVER: f64 = 0.36;

/// What outlines are judged by.
pub(super) struct Judge<'a> {
    pub(super) picture: &'a Picture<'a>,
    pub(super) depth: &'a DepthView<'a>,
    /// The ball's radius, metres.
    pub(super) ball_radius: f64,
}

/// A disc that may be the ball's, and what is known of it.
pub(super) struct Candidate {
    pub(super) fine: Fine,
    outline: Outline,
}

impl Judge<'_> {
    /// The radius (pixels, on the optical axis) of a ball at depth `z`, metres.
    fn radius_at(&self, z: f64) -> f64 {
        self.picture.intrinsics().radius_at(self.ball_radius, z)
    }

    /// The depth, metres, at which a ball is as large as `disc`.
    fn depth_of(&self, disc: &Disc) -> f64 {
        self.picture.intrinsics().depth_of(self.ball_radius, disc.radius)
    }

    /// The disc at `start` to a fraction of a pixel, and what is seen around it. It does not leave
    /// `start` far behind if that is `held`.
    pub(super) fn candidate(&self, start: Disc, held: bool) -> Candidate {
        let mut fine = self.fit(start, held);
        // What is around it was looked at from where it is not, or its depth was another's: once
        // more.
        let moved = (fine.disc.u - start.u).hypot(fine.disc.v - start.v) > MOVED.0 * start.radius;
        let by_depth = self.centre(&fine.disc).map(|z| self.radius_at(z));
        let resized =
            by_depth.is_some_and(|radius| (radius / fine.disc.radius - 1.0).abs() > MOVED.1);
        if moved || resized {
            let radius = by_depth.filter(|_| resized).unwrap_or(fine.disc.radius);
            fine = self.fit(Disc { radius, ..fine.disc }, held);
        }
        let mut outline = self.picture.outline_at(fine.disc);
        let rays = self.picture.rays(&fine.disc);
        for (ray, rim) in outline.rims.iter_mut().enumerate() {
            if fine.edges[ray] {
                *rim = Rim::Edge;
            } else if *rim == Rim::Unseen && self.ends_in_picture(&rays, ray, fine.disc.radius) {
                *rim = Rim::Plain;
            }
        }
        Candidate { fine, outline }
    }

    /// The disc at `start` fitted to its edges, without those of what covers it or is beside it as
    /// far as depth says so, and of the size that depth asks for; `start` itself where there are
    /// too few.
    fn fit(&self, start: Disc, held: bool) -> Fine {
        let depth = self.centre(&start);
        let by_depth = depth.map(|z| self.radius_at(z));
        let around = depth.map(|z| self.around(&self.picture.outline_at(start), z));
        let trusted = around.map_or([true; RAYS], |a| a.trusted());
        let near = |fine: &Fine| {
            let way = (fine.disc.u - start.u).hypot(fine.disc.v - start.v);
            !held || way < HELD.0 * start.radius + HELD.1
        };
        let rough = Matrix3::identity() * (0.15 * start.radius).powi(2);
        let fine = self.picture.refine_edges(start, by_depth, &trusted, held).filter(near);
        fine.unwrap_or(Fine {
            disc: start,
            covariance: rough,
            edges: [false; RAYS],
            blur: 0.0,
            uneven: 0.0,
        })
    }

    /// Whether `disc`, about where a ball may be, has hardly anything of the ball's colour or is
    /// flat beyond doubt: cheaper than to look what is around it.
    pub(super) fn is_hopeless(&self, disc: &Disc) -> bool {
        let depth = self.centre(disc);
        let round = depth.and_then(|z| roundness(disc, self.depth, z, self.ball_radius, ROUGHLY));
        round.is_some_and(|round| round.1 < FLAT_SURFACE)
            || f64::from(self.sight(disc, depth).likeness) < PALE
    }

    /// Whether what is at `disc`, where a ball would be, may be the ball once its outline is
    /// fitted: cheaper than to fit and judge it.
    pub(super) fn may_be(&self, disc: &Disc) -> bool {
        let outline = || self.picture.outline_at(*disc);
        let Some(z) = self.centre(disc) else {
            let z = self.depth_of(disc);
            let outline = outline();
            return self.bare(disc, &outline, &self.around(&outline, z), z).odds() > NO_BALL.1;
        };
        let surface = self.surface(disc, z, ROUGHLY);
        surface.odds() > NO_BALL.0 && {
            let outline = outline();
            surface.with(&self.around(&outline, z), &outline).odds() > NO_BALL.0
        }
    }

    /// Whether a ray enters the picture before it ends, and ends in it: the middle of its disc may
    /// be outside.
    fn ends_in_picture(&self, rays: &Rays, ray: usize, radius: f64) -> bool {
        [0.8, 1.0, 1.3].iter().all(|&radii| {
            let pixel = rays.at(ray, radii * radius);
            pixel.is_some_and(|(u, v)| self.picture.colour_at(u, v).is_some())
        })
    }

    /// How sure it is that `candidate` is the ball: 0 to 1, the probability by all that is seen of
    /// it; less where it has no depth. Enough of its outline must be free in either case. What will
    /// be less than `least` is not looked at to the end, and is 0.
    pub(super) fn score(&self, candidate: &Candidate, least: f64) -> f64 {
        let Candidate { fine, outline } = candidate;
        let by_picture = self.depth_of(&fine.disc);
        let depth = self.centre(&fine.disc);
        let around = self.around(outline, depth.unwrap_or(by_picture));
        let free = around.part(Side::Free) + around.part(Side::Behind);
        if free <= FREE.0 || free / (1.0 - around.covered()).max(0.01) <= FREE.1 {
            return 0.0;
        }
        match depth {
            Some(z) => self.with_depth(candidate, &around, z, least),
            None => UNKNOWN * self.without_depth(candidate, &around, by_picture, least / UNKNOWN),
        }
    }

    /// The score of what has depth `z`.
    fn with_depth(&self, candidate: &Candidate, around: &Around, z: f64, least: f64) -> f64 {
        let Candidate { fine, outline } = candidate;
        let part = around.seen() / RAYS as f64;
        let edges = fine.found() / around.seen();
        // Of a larger ball's cap at the border less fits, and a sliver of it may be a smaller one.
        let cap = if part > WHOLE { 1.0 } else { ramp(edges, 0.4, 0.75) };
        if cap == 0.0 || part < SLIVER {
            return 0.0;
        }
        let evidence = self.surface(&fine.disc, z, FINELY).with(around, outline);
        let odds = evidence.odds();
        if cap * probability(odds) < least {
            return 0.0;
        }
        let alone = self.alone(fine, self.radius_at(z), around);
        let behind = if evidence.is_sphere() { around.part(Side::Behind) } else { 0.0 };
        alone.map_or(0.0, |alone| {
            cap * probability(odds - alone.against(evidence.roundness(), behind))
        })
    }

    /// What is seen on `disc` at depth `z`, its surface read at `half` places from the middle to
    /// the edge; nothing beside it.
    fn surface(&self, disc: &Disc, z: f64, half: i32) -> Evidence {
        Evidence {
            attached: 0.0,
            continued: 0.0,
            alike: 0.0,
            goes_on: 0.0,
            likeness: f64::from(self.sight(disc, Some(z)).likeness),
            round: roundness(disc, self.depth, z, self.ball_radius, half),
            on_sphere: on_sphere(disc, self.depth, z, self.ball_radius, grid()),
        }
    }

    /// The score of what has no depth: a ball of its size is at depth `z`, metres.
    fn without_depth(&self, candidate: &Candidate, around: &Around, z: f64, least: f64) -> f64 {
        let Candidate { fine, outline } = candidate;
        let odds = self.bare(&fine.disc, outline, around, z).odds();
        if probability(odds) < least {
            return 0.0;
        }
        let edges = fine.found() / RAYS as f64;
        let alone = self.alone(fine, fine.disc.radius, around);
        alone.map_or(0.0, |alone| probability(odds - alone.against_bare(edges)))
    }

    /// What is seen of `disc`, which has no depth: a ball of its size is at depth `z`, metres.
    fn bare(&self, disc: &Disc, outline: &Outline, around: &Around, z: f64) -> Bare {
        let sight = self.sight(disc, None);
        Bare {
            likeness: f64::from(sight.likeness),
            shading: f64::from(sight.shading),
            contrast: outline.contrast,
            through: self.seen_through(disc, z),
            covered: around.covered(),
            behind: around.part(Side::Behind),
        }
    }

    /// What the outline of a disc that should have `radius` pixels says by itself.
    fn alone(&self, fine: &Fine, radius: f64, around: &Around) -> Option<Alone> {
        let beside = around.part(Side::Attached) + around.part(Side::Continued);
        let able = (1.0 - around.covered() - beside).max(0.4) * around.seen();
        Alone::of(self.picture, fine, radius, &around.trusted(), able)
    }

    /// Part of the inner disc that has the depth of something that is not in front of a ball at
    /// `z`.
    fn seen_through(&self, disc: &Disc, z: f64) -> f64 {
        self.share(disc, grid().filter(|(x, y)| x * x + y * y < 0.4), |o| o > z)
    }

    /// The colour and the shading on a disc: of what is not in front of a ball at depth `z`.
    fn sight(&self, disc: &Disc, z: Option<f64>) -> Sight {
        let mut likenesses = Vec::with_capacity(64);
        let mut parts = [(0.0_f32, 0.0_f32); 9];
        for (x, y) in grid() {
            let (u, v) = (disc.u + x * disc.radius, disc.v + y * disc.radius);
            let covered = z.zip(self.depth.at(u, v)).is_some_and(|(z, o)| self.is_before(o, z));
            let Some(colour) = self.picture.colour_at(u, v).filter(|_| !covered) else { continue };
            likenesses.push(self.picture.ball().damped(colour, NOISE));
            let ninth = |k: f64| ((k + 1.0) * 1.5) as usize;
            let part = &mut parts[ninth(y) * 3 + ninth(x)];
            *part = (part.0 + colour.iter().sum::<f32>(), part.1 + 1.0);
        }
        likenesses.sort_by(f32::total_cmp);
        let means = parts.iter().filter(|(_, n)| *n > 2.0).map(|(sum, n)| sum / n);
        let (least, most, sum, n) = means
            .fold((f32::INFINITY, 0.0_f32, 0.0, 0.0), |(a, b, sum, n), m| {
                (a.min(m), b.max(m), sum + m, n + 1.0)
            });
        let shading = if n > 4.0 { (most - least) / (sum / n + 1.0) } else { 0.0 };
        let likeness = likenesses.get(likenesses.len() * 13 / 20).copied().unwrap_or(0.0);
        Sight { likeness, shading }
    }

    /// Depth of the ball's centre, metres, where enough of what is seen of the disc agrees on it.
    ///
    /// What has the ball's colour is asked first: a post before the ball may be more of the disc
    /// than the ball.
    fn centre(&self, disc: &Disc) -> Option<f64> {
        let place = (disc.u, disc.v, disc.radius);
        let enough = |known: &CentreDepth| {
            let seen = 1.0 - self.covered(disc, known.depth);
            known.support >= KNOWN * seen.max(0.3)
        };
        let coloured = |u: f64, v: f64| self.picture.likeness(u, v) >= COLOURED;
        let known =
            rough_centre_depth(place, self.depth, self.ball_radius, coloured).filter(enough);
        let all =
            || rough_centre_depth(place, self.depth, self.ball_radius, |_, _| true).filter(enough);
        known.or_else(all).map(|known| known.depth)
    }

    /// Part of a disc that something in front of a ball at depth `z` hides.
    fn covered(&self, disc: &Disc, z: f64) -> f64 {
        self.share(disc, grid(), |o| self.is_before(o, z))
    }

    /// Part of these places on a disc, in its radius, that have such a depth.
    fn share(
        &self,
        disc: &Disc,
        places: impl Iterator<Item = (f64, f64)>,
        such: impl Fn(f64) -> bool,
    ) -> f64 {
        let (mut found, mut all) = (0, 0);
        for (x, y) in places {
            all += 1;
            let o = self.depth.at(disc.u + x * disc.radius, disc.v + y * disc.radius);
            found += usize::from(o.is_some_and(&such));
        }
        found as f64 / f64::from(all)
    }

    /// Whether something at depth `o` is in front of a ball at depth `z`.
    fn is_before(&self, o: f64, z: f64) -> bool {
        o < z - 1.5 * self.ball_radius
    }
}

impl Evidence {
    /// The same with what is beside the disc.
    fn with(self, around: &Around, outline: &Outline) -> Self {
        Self {
            attached: around.part(Side::Attached),
            continued: around.part(Side::Continued),
            alike: around.part(Side::CoveredAlike),
            goes_on: around.goes_on(outline),
            ..self
        }
    }
}

/// Places spread over a disc but for its rim, in its radius.
fn grid() -> impl Iterator<Item = (f64, f64)> {
    let places =
        (-4..=4).flat_map(|j| (-4..=4).map(move |i| (f64::from(i) * 0.22, f64::from(j) * 0.22)));
    places.filter(|(x, y)| x * x + y * y < 0.8)
}

/// What is seen on a disc.
struct Sight {
    /// How much of the ball's colour the better third of it has at least, 0 to 1.
    likeness: f32,
    /// By how much its ninths differ in brightness, over their mean: no sphere is lit evenly.
    shading: f32,
}

/// 0 up to `low`, 1 from `high`, straight between.
fn ramp(x: f64, low: f64, high: f64) -> f64 {
    ((x - low) / (high - low)).clamp(0.0, 1.0)
}
