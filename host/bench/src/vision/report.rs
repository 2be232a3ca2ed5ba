//! Result of a comparison.

use serde::Serialize;

use super::FrameGroup;

/// Result of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VisionReport {
    /// Always `"vision"`.
    pub suite: &'static str,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of frames of each kind of scene.
    pub frames: usize,
    /// Median time of the full-size f32 difference of Gaussians on the red channel, one thread,
    /// milliseconds.
    pub reference_ms: f64,
    /// Results of the detectors, in the order given.
    pub detectors: Vec<DetectorReport>,
}

/// Result of one detector.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DetectorReport {
    /// Its name.
    pub name: &'static str,
    /// Median time for a frame, one thread, milliseconds.
    pub median_ms: f64,
    /// That time over `reference_ms`.
    pub ratio: f64,
    /// That ratio for frames without a ball; `None` if there were none.
    pub empty_ratio: Option<f64>,
    /// Scene with the greatest median time, and the ratio of that time.
    pub slowest: Option<(&'static str, f64)>,
    /// Time from the frame to the bytes for the board (detection, localisation, encoding) without
    /// tracking, 99th percentile, milliseconds.
    pub path_p99_ms: f64,
    /// Ratio of the median time for a repeated frame, in which a detector can track the ball.
    pub tracking_ratio: f64,
    /// Share of all balls that it hit, 0 to 1.
    pub hit_rate: f64,
    /// Detections that were no hit, in all scenes.
    pub false_alarms: usize,
    /// Mean of the squared errors of position over their covariance, in all scenes: 3 where the
    /// covariance is right.
    pub consistency: Option<f64>,
    /// Sums of the kinds that share a target; empty for suites without such groups.
    pub groups: Vec<GroupReport>,
    /// Scene by scene.
    pub scenes: Vec<SceneReport>,
    /// Times in each of the `scenes`, in the same order.
    pub times: Vec<SceneTimes>,
}

/// Result of one detector in a group of kinds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupReport {
    /// The group.
    pub group: FrameGroup,
    /// Number of frames.
    pub frames: usize,
    /// Number of frames with a ball.
    pub balls: usize,
    /// Detections within half the ball's radius of its centre.
    pub hits: usize,
    /// Other detections.
    pub false_alarms: usize,
    /// Number of hits with a position.
    pub located: usize,
    /// Mean of the squared errors of position over their covariance; `None` without positions.
    pub consistency: Option<f64>,
}

/// Times of one detector in one kind of scene, over `reference_ms`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneTimes {
    /// Name of the scene.
    pub scene: &'static str,
    /// Median for a frame without knowledge of the one before.
    pub ratio: f64,
    /// Median for a repeated frame; `None` if nothing was found.
    pub tracking_ratio: Option<f64>,
    /// 99th percentile from the frame to the bytes for the board.
    pub path_p99_ratio: f64,
}

/// Result of one detector in one kind of scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneReport {
    /// Name of the scene.
    pub scene: &'static str,
    /// Group that the scene counts in, if its suite has groups.
    pub group: Option<FrameGroup>,
    /// Number of frames.
    pub frames: usize,
    /// Number of frames with a ball.
    pub balls: usize,
    /// Detections within half the ball's radius of its centre.
    pub hits: usize,
    /// Other detections: elsewhere than the ball, or where there is none.
    pub false_alarms: usize,
    /// Median distance of the hits from the ball's projected centre, pixels.
    pub error_median_px: Option<f64>,
    /// 95th percentile of that distance, pixels.
    pub error_p95_px: Option<f64>,
    /// 99th percentile of that distance, pixels.
    pub error_p99_px: Option<f64>,
    /// Number of hits with a position.
    pub located: usize,
    /// Median distance of those from the ball's centre, millimetres.
    pub position_median_mm: Option<f64>,
    /// 95th percentile of that distance, millimetres.
    pub position_p95_mm: Option<f64>,
    /// Mean of that error squared over its covariance: 3 where the covariance fits
    /// the errors.
    pub consistency: Option<f64>,
    /// 95th percentile of the same: 7.8 of a normal distribution.
    pub consistency_p95: Option<f64>,
}
