//! The default detector: colour proposes, shape and size against depth decide.
//!
//! 1. Red blobs of all the sizes that a ball can have are looked for in a coarse picture
//!    (`propose`). Where there is depth, a ball has one size only, and blobs of another are passed
//!    over.
//! 2. Around each of the best the outline is fitted at full size (`outline`).
//! 3. Each outline is looked at (`judge`): how much of it is seen, how much of it is red, how round
//!    its surface is, what goes on beside it, and which disc its edges make when they are told
//!    nothing of the depth. All of it together is the probability that it is the ball (`evidence`).
//!    The best one is the ball if that is enough; otherwise there is none.

use opencv::core::Rect;

use super::coarse::Coarse;
use super::colour::BallColour;
use super::edge::Fine;
use super::judge::Judge;
use super::picture::{Disc, Picture};
use super::propose::Proposal;
use super::sphere::{Depths, seen};
use super::{BallDetector, DetectError};
use crate::camera::{Camera, Intrinsics};
use crate::frame::RgbdFrame;
use crate::localise::DepthView;
use crate::observation::{BallObservation, Circle};

/// Distances at which the ball is looked for, metres.
const DISTANCES: (f64, f64) = (0.25, 2.5);
/// The score from which on it is a ball.
const THRESHOLD: f64 = 0.52;
/// How far from where it was last the ball is looked for first: in its radius, and pixels more.
const WINDOW: (f64, f64) = (3.0, 16.0);
/// The score with which it is found there; below it the whole picture is searched.
const KEPT: f64 = 0.75;
/// A score that ends the search: nothing else will do better by much.
const CERTAIN: f64 = 0.95;
/// Spheres in the depth picture that are looked at closely.
const SPHERES: usize = 4;
/// Places that are looked at closely: with a depth that fits, and without depth.
const LOOKED_AT: (usize, usize) = (3, 2);
/// Places that are glanced at before.
const GLANCES: usize = 10;
/// Where the surroundings of a blob are looked at, in a ball's radius: the blob need not be its
/// middle.
const AROUND: f64 = 1.7;
/// Discs as near as this, and as much of one size, in the smaller one's radius, will be fitted to
/// one outline.
const NEAR: (f64, f64) = (0.12, 0.1);
/// A blob's size may be off by this factor: the steps between sizes, and blobs that are partly
/// covered.
const SIZE_FACTOR: f64 = 2.0;

/// Finds a red ball of known size, sub-pixel, at any distance from 0.25 to 2.5 m; says that there
/// is none where no red thing is round and of the right size. Its score is 0 to 1; 0.52 and more is
/// a ball. A ball without depth scores 0.9 at most.
#[derive(Debug, Clone)]
pub struct ShapeDetector {
    camera: Camera,
    ball_radius: f64,
    colour: BallColour,
    /// Where it was in the picture before.
    last: Option<Disc>,
}

impl ShapeDetector {
    /// Makes a detector for the ball that `camera` looks for.
    pub fn new(camera: &Camera) -> Self {
        let (ball_radius, colour) = (camera.ball_diameter / 2.0, BallColour::new(camera.ball_hue));
        Self { camera: camera.clone(), ball_radius, colour, last: None }
    }

    /// The best candidate in a window of the picture and its score.
    fn best(&self, frame: &RgbdFrame, window: Rect) -> Result<Option<(Fine, f64)>, DetectError> {
        let picture = Picture::new(frame.colour(), frame.intrinsics(), self.colour);
        let depth = DepthView::of(frame);
        let judge = Judge { picture: &picture, depth: &depth, ball_radius: self.ball_radius };
        let coarse =
            Coarse::new(frame.colour(), window, self.colour).map_err(DetectError::processing)?;
        let radii = self.radii(frame.intrinsics());
        let fits = |radius: f64| (0.93 * radii.0..1.07 * radii.1).contains(&radius);
        let mut best: Option<(Fine, f64)> = None;
        // What was looked at: from where, and what it became. From near either nothing else will
        // come.
        let mut known: Vec<Disc> = Vec::new();
        let mut consider = |start: Disc, held: bool| {
            if known.iter().any(|disc| is_near(disc, &start)) {
                return false;
            }
            let candidate = judge.candidate(start, held);
            let least = best.map_or(THRESHOLD, |b| b.1.max(THRESHOLD));
            let fits = fits(candidate.fine.disc.radius);
            let score = if fits { judge.score(&candidate, least) } else { 0.0 };
            known.extend([start, candidate.fine.disc]);
            // Of equal ones the more promising one's.
            if best.is_none_or(|b| score > b.1) {
                best = Some((candidate.fine, score));
            }
            score > CERTAIN
        };
        let depths = Depths { picture: &picture, depth: &depth, ball_radius: self.ball_radius };
        let spheres = depths.spheres(&coarse);
        let discs = spheres.iter().filter_map(|centre| seen(&picture, centre, self.ball_radius));
        if discs.filter(|disc| judge.may_be(disc)).take(SPHERES).any(|disc| consider(disc, true)) {
            return Ok(best);
        }
        for start in self.starts(&coarse, &judge) {
            let sphere = start.surface.and_then(|z| depths.sphere_at(&start.disc, z));
            let by_depth = sphere.and_then(|centre| seen(&picture, &centre, self.ball_radius));
            let by_outline =
                || picture.fit(start.disc, start.surface.is_none()).map(|outline| outline.disc);
            let disc = by_depth.or_else(by_outline);
            if disc.is_some_and(|disc| judge.may_be(&disc) && consider(disc, false)) {
                break;
            }
        }
        Ok(best)
    }

    /// The smallest and the largest radius that the ball can have in a picture, pixels.
    fn radii(&self, intrinsics: &Intrinsics) -> (f64, f64) {
        let at = |z: f64| intrinsics.radius_at(self.ball_radius, z);
        (at(DISTANCES.1), at(DISTANCES.0))
    }

    /// The places to look at closely.
    fn starts(&self, coarse: &Coarse, judge: &Judge) -> Vec<Start> {
        let (intrinsics, depth) = (judge.picture.intrinsics(), judge.depth);
        let mut starts: Vec<Start> = Vec::new();
        let (mut with_depth, mut without) = LOOKED_AT;
        let mut glances = GLANCES;
        for proposal in coarse.propose(self.radii(intrinsics)) {
            let Some(start) = self.start(&proposal, intrinsics, depth) else { continue };
            let left = if start.surface.is_some() { &mut with_depth } else { &mut without };
            if *left == 0
                || starts.iter().any(|s| s.same_as(&start))
                || self.is_attached(&start, depth)
            {
                continue;
            }
            glances -= 1;
            if !judge.is_hopeless(&start.disc) {
                *left -= 1;
                starts.push(start);
            }
            if glances == 0 {
                break;
            }
        }
        starts
    }

    /// Whether what is around a start is mostly as near as itself: a part of something larger.
    fn is_attached(&self, start: &Start, depth: &DepthView) -> bool {
        let Some(z) = start.surface else { return false };
        let near = |i: u32| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / 16.0).sin_cos();
            let reach = AROUND * start.disc.radius;
            let (u, v) = (start.disc.u + reach * cos, start.disc.v + reach * sin);
            depth.at(u, v).is_some_and(|o| (o - z).abs() < self.ball_radius)
        };
        (0..16).filter(|&i| near(i)).count() > 8
    }

    /// Where to look closely for what is proposed; `None` where depth says that a ball would be of
    /// another size.
    fn start(
        &self,
        proposal: &Proposal,
        intrinsics: &Intrinsics,
        depth: &DepthView,
    ) -> Option<Start> {
        let disc = proposal.disc;
        let Some(z) = depth_about(&disc, depth) else {
            return Some(Start { disc, surface: None });
        };
        let radius = intrinsics.radius_at(self.ball_radius, z + self.ball_radius);
        let factor = (radius / disc.radius).max(disc.radius / radius);
        (factor < SIZE_FACTOR).then_some(Start { disc: Disc { radius, ..disc }, surface: Some(z) })
    }
}

/// Where an outline is looked for.
#[derive(Debug, Clone, Copy)]
struct Start {
    disc: Disc,
    /// Depth of what is seen there, metres; where it is known the disc's radius is that of a ball
    /// there.
    surface: Option<f64>,
}

impl Start {
    /// Whether both would lead to one outline.
    fn same_as(&self, other: &Start) -> bool {
        let (a, b) = (&self.disc, &other.disc);
        let (small, large) = (a.radius.min(b.radius), a.radius.max(b.radius));
        (a.u - b.u).hypot(a.v - b.v) < 0.4 * small && large < 1.5 * small
    }
}

/// Whether two discs are nearly one.
fn is_near(a: &Disc, b: &Disc) -> bool {
    let least = a.radius.min(b.radius);
    (a.u - b.u).hypot(a.v - b.v) < NEAR.0 * least && (a.radius - b.radius).abs() < NEAR.1 * least
}

/// The median depth, metres, of nine pixels about the middle of `disc`; `None` where fewer than
/// four have depth.
fn depth_about(disc: &Disc, depth: &DepthView) -> Option<f64> {
    let mut depths = [0.0; 9];
    let mut n = 0;
    for i in 0..9 {
        let off = |k: i32| f64::from(k - 1) * 0.4 * disc.radius;
        if let Some(z) = depth.at(disc.u + off(i % 3), disc.v + off(i / 3)) {
            depths[n] = z;
            n += 1;
        }
    }
    depths[..n].sort_by(f64::total_cmp);
    (n >= 4).then(|| depths[n / 2])
}

impl ShapeDetector {
    /// The window of the picture in which a ball is that was seen as `last` a moment ago; whole
    /// coarse pixels.
    fn window(last: &Disc, whole: Rect) -> Rect {
        let reach = WINDOW.0 * last.radius + WINDOW.1;
        let low = |x: f64| ((x - reach).max(0.0) / 8.0) as i32 * 8;
        let high = |x: f64, size: i32| (((x + reach).max(0.0) / 8.0) as i32 * 8 + 8).min(size);
        let (left, top) = (low(last.u).min(whole.width - 1), low(last.v).min(whole.height - 1));
        let (right, bottom) = (high(last.u, whole.width), high(last.v, whole.height));
        Rect::new(left, top, (right - left).max(1), (bottom - top).max(1))
    }

    /// The best candidate: near where the ball was last if it is sure enough there, or else in the
    /// whole picture.
    fn find(&self, frame: &RgbdFrame) -> Result<Option<(Fine, f64)>, DetectError> {
        let size = frame.colour().size();
        let whole = Rect::new(0, 0, size.width as i32, size.height as i32);
        if let Some(last) = &self.last {
            let near = self.best(frame, Self::window(last, whole))?;
            if near.is_some_and(|(_, score)| score >= KEPT) {
                return Ok(near);
            }
        }
        self.best(frame, whole)
    }
}

impl BallDetector for ShapeDetector {
    fn name(&self) -> &'static str {
        "ball"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        let found = self.find(frame)?.filter(|(_, score)| *score >= THRESHOLD);
        self.last = found.map(|(fine, _)| fine.disc);
        Ok(found.map(|(fine, score)| {
            let Disc { u, v, radius } = fine.disc;
            let circle = Circle { u, v, radius, covariance: fine.place() };
            BallObservation::new(circle, score, frame, &self.camera)
        }))
    }

    fn reset(&mut self) {
        self.last = None;
    }
}
