//! Two free-running cameras before a moving ball.

use nalgebra::Point3;
use plumb_frame::source::BoxedError;
use plumb_vision::camera::Camera;
use plumb_vision::fuse::{Fused, Origin, PairFuser, Side, intersect};
use plumb_vision::observation::{Circle, Gaussian3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::stats::percentile;
use super::case::{Case, Circles, MIDDLE};
use super::errors::Errors;
use super::eyes::{RenderedEye, cameras, computed};
use super::report::CaseReport;

/// Time between two pictures of a camera, seconds.
pub(super) const PERIOD_S: f64 = 1.0 / 30.0;
/// Largest exposure of the second camera after the first one's, seconds.
const MAX_OFFSET_S: f64 = 0.017;
/// Largest error of a stamp, seconds.
const MAX_STAMP_ERROR_S: f64 = 0.003;
/// Time from an exposure to its arrival, seconds.
const LATENCY_S: f64 = 0.03;
/// Pictures of a run, each with another offset, of each camera.
const RUN_FRAMES: usize = 750;
/// Pictures of each camera at the start of a run that are not counted: 8 s, in which the pair
/// learns.
const WARM_UP: usize = 240;
/// Share of the pictures that rendered cases have.
const RENDERED_SHARE: usize = 5;

/// One run of two cameras.
pub(super) struct Stand {
    /// Cameras as they stand.
    pub(super) real: [Camera; 2],
    told: [Camera; 2],
    pub(super) fuser: PairFuser,
    rendered: Option<[RenderedEye; 2]>,
    case: Case,
    random: ChaCha8Rng,
    /// Phase of the movement, radians.
    phase: f64,
    offset: f64,
    /// Number of pictures of each camera.
    frame: usize,
    /// Newest pictures that no plain pair contains yet.
    fresh: [Option<(f64, Circle)>; 2],
}

/// Position of the ball after a picture.
#[derive(Debug, Clone, Copy)]
pub(super) enum Found {
    /// By the fuser.
    Fused(Fused),
    /// By the newest circles of both cameras, as if taken at one moment, with the newer stamp.
    Newest(f64, Gaussian3),
}

impl Stand {
    /// Creates a run, whose cameras are offset by `share` (0 to 1) of the largest offset.
    pub(super) fn new(case: Case, seed: u64, share: f64) -> Result<Self, BoxedError> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let phase = random.random_range(0.0..std::f64::consts::TAU);
        let (real, told) = (cameras(), cameras());
        let rendered = match case.circles {
            Circles::Computed => None,
            _ => Some([RenderedEye::new(&real[0], seed)?, RenderedEye::new(&real[1], !seed)?]),
        };
        let fuser = PairFuser::new(told.clone(), PERIOD_S);
        let (offset, fresh) = (share * MAX_OFFSET_S, [None; 2]);
        Ok(Self { real, told, fuser, rendered, case, random, phase, offset, frame: 0, fresh })
    }

    /// Returns the true place of the ball at `t` seconds.
    pub(super) fn truth(&self, t: f64) -> Point3<f64> {
        MIDDLE + self.case.path.at(t, self.phase)
    }

    /// Takes the next picture of each camera, and calls `visit` with each position.
    pub(super) fn next(&mut self, visit: &mut dyn FnMut(Found)) -> Result<(), BoxedError> {
        let start = self.frame as f64 * PERIOD_S;
        self.frame += 1;
        let late = self.case.late / 2.0;
        for (side, t, late) in
            [(Side::First, start, -late), (Side::Second, start + self.offset, late)]
        {
            let jitter = self.random.random_range(-MAX_STAMP_ERROR_S..MAX_STAMP_ERROR_S);
            let circle = self.circle(side, t)?;
            let (stamp, now) = (t + late + jitter, t + LATENCY_S);
            let fused = self.fuser.take(side, stamp, circle, now);
            fused.into_iter().for_each(|fused| visit(Found::Fused(fused)));
            self.fresh[side as usize] = circle.map(|circle| (stamp, circle));
            let Some((stamp, position)) = self.newest() else { continue };
            visit(Found::Newest(stamp, position));
        }
        Ok(())
    }

    /// Returns the position of the newest circles, if both are new.
    fn newest(&mut self) -> Option<(f64, Gaussian3)> {
        let [(first, one), (second, other)] = [self.fresh[0]?, self.fresh[1]?];
        self.fresh = [None; 2];
        Some((first.max(second), intersect(&self.told, &[one, other])?))
    }

    /// Returns what a camera sees at `t` seconds.
    fn circle(&mut self, side: Side, t: f64) -> Result<Option<Circle>, BoxedError> {
        let (place, index) = (self.truth(t), side as usize);
        if !self.case.sees(t)[index] {
            return Ok(None);
        }
        match &mut self.rendered {
            None => {
                let random = &mut self.random;
                Ok(computed(&self.real[index], &place, self.case.size, random))
            }
            Some(eyes) => {
                let beside = self.case.post(t)[index];
                eyes[index].circle(t, &place, beside)
            }
        }
    }
}

/// Runs a case. `frames` is the number of pictures of each camera.
pub(super) fn run(case: &Case, seed: u64, frames: usize) -> Result<CaseReport, BoxedError> {
    let share = if case.circles == Circles::Computed { 1 } else { RENDERED_SHARE };
    let runs = (frames / share).div_ceil(RUN_FRAMES - WARM_UP).max(1);
    let counted = (frames / share).div_ceil(runs);
    let (mut fused, mut newest, mut jumps) = (Errors::default(), Errors::default(), Vec::new());
    let (mut alarms, mut latencies) = (0, Vec::new());
    for run in 0..runs {
        let offset = (run as f64 + 0.5) / runs as f64;
        let mut stand = Stand::new(*case, seed.wrapping_mul(1000) + run as u64, offset)?;
        let mut last: Option<Fused> = None;
        for frame in 0..WARM_UP + counted {
            let mut found = Vec::new();
            stand.next(&mut |it| found.push(it))?;
            for it in found.into_iter().filter(|_| frame >= WARM_UP) {
                match it {
                    Found::Newest(stamp, position) => newest.add(&position, &stand.truth(stamp)),
                    Found::Fused(it) => {
                        let place = stand.truth(it.stamp);
                        fused.add(&it.position, &place);
                        jumps.extend(last.and_then(|last| jump(&last, &it, &stand)));
                        last = Some(it);
                    }
                }
            }
        }
        alarms += usize::from(stand.fuser.alarm().is_some());
        latencies.extend(stand.fuser.latency_difference().map(|it| 1e3 * it));
    }
    Ok(CaseReport {
        name: case.name,
        fused: fused.report(),
        newest: newest.report(),
        jump_p95_mm: percentile(&mut jumps, 0.95),
        latency_ms: percentile(&mut latencies, 0.5),
        alarms,
    })
}

/// Returns the jump (millimetres) from a pair to an outline or back, without the ball's movement.
fn jump(last: &Fused, next: &Fused, stand: &Stand) -> Option<f64> {
    let [before, after] = [last, next].map(|fused| matches!(fused.origin, Origin::Pair(_)));
    let moved = stand.truth(next.stamp) - stand.truth(last.stamp);
    let jump = next.position.mean - last.position.mean - moved;
    (before != after).then(|| 1e3 * jump.norm())
}
