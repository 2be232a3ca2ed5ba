//! Statistics of a detector over the frames.

use plumb_vision::observation::BallObservation;

use super::labelled::{GroundTruth, LabelledFrame};
use super::{DetectorReport, FrameGroup, GroupReport, SceneReport, SceneTimes};

/// Statistics of one detector.
#[derive(Debug, Default)]
pub(super) struct DetectorStats {
    /// Measurements in the present scene.
    present: SceneStats,
    /// Times in the scenes before.
    times: Times,
    /// Squared Mahalanobis distances in the scenes before.
    normalised: Vec<f64>,
    /// Times of each scene, milliseconds.
    scene_times: Vec<SceneTimes>,
    scenes: Vec<SceneReport>,
}

/// Measurements in one scene.
#[derive(Debug, Default)]
struct SceneStats {
    times: Times,
    frames: usize,
    balls: usize,
    false_alarms: usize,
    /// Distances of the hits from the projected centre, pixels.
    errors: Vec<f64>,
    /// Distances of the hits' positions from the centre, millimetres.
    positions: Vec<f64>,
    /// Squared Mahalanobis distances of those positions.
    normalised: Vec<f64>,
}

/// Times of a detector.
#[derive(Debug, Default)]
pub(super) struct Times {
    /// Time for each frame.
    pub(super) searching: Vec<FrameTime>,
    /// Times from the frame to the bytes for the board, milliseconds.
    pub(super) path: Vec<f64>,
    /// Times for a repeated frame, milliseconds.
    pub(super) tracking: Vec<f64>,
}

/// Time of a detector for one frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameTime {
    /// Computing time, milliseconds.
    pub(super) ms: f64,
    /// Whether the frame contains a ball.
    pub(super) ball: bool,
}

impl DetectorStats {
    /// Returns the times in the present scene, to add further ones.
    pub(super) fn times(&mut self) -> &mut Times {
        &mut self.present.times
    }

    /// Adds a frame and its detection.
    pub(super) fn add(&mut self, frame: &LabelledFrame, found: Option<BallObservation>) {
        let scene = &mut self.present;
        scene.frames += 1;
        scene.balls += usize::from(frame.ball.is_some());
        let Some(BallObservation { circle, position, .. }) = found else { return };
        let error = |ball: &GroundTruth| (circle.u - ball.u).hypot(circle.v - ball.v);
        let Some(ball) = frame.ball.filter(|ball| error(ball) <= ball.radius / 2.0) else {
            scene.false_alarms += 1;
            return;
        };
        scene.errors.push(error(&ball));
        if let Some(position) = position {
            let off = position.mean - ball.centre;
            scene.positions.push(1e3 * off.norm());
            let inverse = position.covariance.try_inverse();
            scene.normalised.extend(inverse.map(|inverse| off.dot(&(inverse * off))));
        }
    }

    /// Ends a scene and stores its report.
    pub(super) fn end_scene(&mut self, scene: &'static str, group: Option<FrameGroup>) {
        let mut ended = std::mem::take(&mut self.present);
        let times = &mut ended.times;
        let mut searching: Vec<f64> = times.searching.iter().map(|time| time.ms).collect();
        self.scene_times.push(SceneTimes {
            scene,
            ratio: percentile(&mut searching, 0.5).unwrap_or(0.0),
            tracking_ratio: percentile(&mut times.tracking, 0.5),
            path_p99_ratio: percentile(&mut times.path, 0.99).unwrap_or(0.0),
        });
        self.scenes.push(SceneReport {
            scene,
            group,
            frames: ended.frames,
            balls: ended.balls,
            hits: ended.errors.len(),
            false_alarms: ended.false_alarms,
            error_median_px: percentile(&mut ended.errors, 0.5),
            error_p95_px: percentile(&mut ended.errors, 0.95),
            error_p99_px: percentile(&mut ended.errors, 0.99),
            located: ended.positions.len(),
            position_median_mm: percentile(&mut ended.positions, 0.5),
            position_p95_mm: percentile(&mut ended.positions, 0.95),
            consistency: mean(&ended.normalised),
            consistency_p95: percentile(&mut ended.normalised, 0.95),
        });
        self.times.searching.append(&mut ended.times.searching);
        self.times.path.append(&mut ended.times.path);
        self.times.tracking.append(&mut ended.times.tracking);
        self.normalised.append(&mut ended.normalised);
    }

    /// Returns the sums of the scenes of a group; `None` if there are none.
    fn group(&self, group: FrameGroup) -> Option<GroupReport> {
        let scenes = || self.scenes.iter().filter(|scene| scene.group == Some(group));
        let sum = |of: fn(&SceneReport) -> usize| scenes().map(of).sum::<usize>();
        let located = sum(|s| s.located);
        let squares: f64 =
            scenes().filter_map(|s| s.consistency.map(|mean| mean * s.located as f64)).sum();
        (scenes().count() > 0).then(|| GroupReport {
            group,
            frames: sum(|s| s.frames),
            balls: sum(|s| s.balls),
            hits: sum(|s| s.hits),
            false_alarms: sum(|s| s.false_alarms),
            located,
            consistency: (located > 0).then(|| squares / located as f64),
        })
    }

    /// Returns the report of all scenes. `reference_ms` is the time of the reference, milliseconds.
    pub(super) fn report(mut self, name: &'static str, reference_ms: f64) -> DetectorReport {
        let median = |ball: Option<bool>| {
            let wanted = self.times.searching.iter();
            let wanted = wanted.filter(|time| ball.is_none_or(|ball| ball == time.ball));
            percentile(&mut wanted.map(|time| time.ms).collect::<Vec<_>>(), 0.5)
        };
        let (median_ms, empty_ms) = (median(None).unwrap_or(0.0), median(Some(false)));
        let ratio = |ms: f64| ms / reference_ms.max(1e-9);
        let tracking_ms = percentile(&mut self.times.tracking, 0.5).unwrap_or(0.0);
        let times: Vec<SceneTimes> = self
            .scene_times
            .iter()
            .map(|times| SceneTimes {
                ratio: ratio(times.ratio),
                tracking_ratio: times.tracking_ratio.map(ratio),
                path_p99_ratio: ratio(times.path_p99_ratio),
                ..*times
            })
            .collect();
        let slowest = times.iter().max_by(|a, b| a.ratio.total_cmp(&b.ratio));
        let sum = |of: fn(&SceneReport) -> usize| self.scenes.iter().map(of).sum::<usize>();
        let (hits, balls, false_alarms) =
            (sum(|s| s.hits), sum(|s| s.balls), sum(|s| s.false_alarms));
        DetectorReport {
            name,
            median_ms,
            ratio: ratio(median_ms),
            empty_ratio: empty_ms.map(ratio),
            slowest: slowest.map(|slowest| (slowest.scene, slowest.ratio)),
            path_p99_ms: percentile(&mut self.times.path, 0.99).unwrap_or(0.0),
            tracking_ratio: ratio(tracking_ms),
            consistency: mean(&self.normalised),
            hit_rate: hits as f64 / balls.max(1) as f64,
            false_alarms,
            groups: FrameGroup::ALL.iter().filter_map(|&group| self.group(group)).collect(),
            scenes: self.scenes,
            times,
        }
    }
}

/// Returns the mean; `None` if there are no values.
fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Returns the least value that a share (0 to 1) of `values` does not exceed; `None` if there are
/// no values.
pub(super) fn percentile(values: &mut [f64], share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let index = (share * values.len() as f64).ceil() as usize;
    values.get(index.saturating_sub(1)).copied()
}
