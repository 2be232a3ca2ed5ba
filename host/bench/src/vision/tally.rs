//! Counting what a detector finds.

use plumb_vision::observation::BallObservation;

use super::scenes::Shot;
use super::{DetectorReport, SceneReport};

/// What is counted of one detector.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// Milliseconds, and whether there was a ball.
    pub(super) times: Vec<(f64, bool)>,
    pub(super) path_times: Vec<f64>,
    /// Those of the scene before this one end here.
    timed: usize,
    slowest: Option<(&'static str, f64)>,
    pub(super) tracking_times: Vec<f64>,
    scenes: Vec<SceneReport>,
    frames: usize,
    balls: usize,
    false_alarms: usize,
    errors: Vec<f64>,
    /// Millimetres.
    positions: Vec<f64>,
    /// Squares of those over their covariance.
    normalised: Vec<f64>,
    /// Those of all scenes.
    all_normalised: Vec<f64>,
}

impl Tally {
    pub(super) fn open(&mut self) {
        (self.frames, self.balls, self.false_alarms) = (0, 0, 0);
        self.errors.clear();
        self.positions.clear();
        self.normalised.clear();
    }

    pub(super) fn note(&mut self, shot: &Shot, found: Option<BallObservation>) {
        self.frames += 1;
        self.balls += usize::from(shot.ball.is_some());
        let Some(BallObservation { circle, position, .. }) = found else { return };
        let error = shot.ball.map(|[u, v, radius]| ((circle.u - u).hypot(circle.v - v), radius));
        match error {
            Some((error, radius)) if error <= radius / 2.0 => self.errors.push(error),
            _ => {
                self.false_alarms += 1;
                return;
            }
        }
        if let Some(position) = position {
            let off = position.mean - shot.centre;
            self.positions.push(1e3 * off.norm());
            let inverse = position.covariance.try_inverse();
            self.normalised.extend(inverse.map(|inverse| off.dot(&(inverse * off))));
        }
    }

    pub(super) fn close(&mut self, scene: &'static str) {
        let mut times: Vec<f64> = self.times.iter().skip(self.timed).map(|(ms, _)| *ms).collect();
        self.timed = self.times.len();
        let ms = percentile(&mut times, 0.5).unwrap_or(0.0);
        if self.slowest.is_none_or(|(_, slowest)| ms > slowest) {
            self.slowest = Some((scene, ms));
        }
        self.scenes.push(SceneReport {
            scene,
            frames: self.frames,
            balls: self.balls,
            hits: self.errors.len(),
            false_alarms: self.false_alarms,
            error_median_px: percentile(&mut self.errors, 0.5),
            error_p95_px: percentile(&mut self.errors, 0.95),
            located: self.positions.len(),
            position_median_mm: percentile(&mut self.positions, 0.5),
            position_p95_mm: percentile(&mut self.positions, 0.95),
            consistency: mean(&self.normalised),
            consistency_p95: percentile(&mut self.normalised, 0.95),
        });
        self.all_normalised.append(&mut self.normalised);
    }

    pub(super) fn report(mut self, name: &'static str, reference_ms: f64) -> DetectorReport {
        let median = |ball: Option<bool>| {
            let wanted = self.times.iter().filter(|(_, is)| ball.is_none_or(|ball| ball == *is));
            percentile(&mut wanted.map(|(ms, _)| *ms).collect::<Vec<_>>(), 0.5)
        };
        let (median_ms, empty_ms) = (median(None).unwrap_or(0.0), median(Some(false)));
        let ratio = |ms: f64| ms / reference_ms.max(1e-9);
        let tracking_ms = percentile(&mut self.tracking_times, 0.5).unwrap_or(0.0);
        let sum = |of: fn(&SceneReport) -> usize| self.scenes.iter().map(of).sum::<usize>();
        let (hits, balls, false_alarms) =
            (sum(|s| s.hits), sum(|s| s.balls), sum(|s| s.false_alarms));
        DetectorReport {
            name,
            median_ms,
            ratio: ratio(median_ms),
            empty_ratio: empty_ms.map(ratio),
            slowest: self.slowest.map(|(scene, ms)| (scene, ratio(ms))),
            path_p99_ms: percentile(&mut self.path_times, 0.99).unwrap_or(0.0),
            tracking_ratio: ratio(tracking_ms),
            consistency: mean(&self.all_normalised),
            hit_rate: hits as f64 / balls.max(1) as f64,
            false_alarms,
            scenes: self.scenes,
        }
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The smallest value that `share` of `values` do not exceed; `None` of no values.
pub(super) fn percentile(values: &mut [f64], share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let index = (share * values.len() as f64).ceil() as usize;
    values.get(index.saturating_sub(1)).copied()
}
