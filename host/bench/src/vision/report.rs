//! What the comparison says.

use serde::Serialize;

/// The comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VisionReport {
    /// Always `"vision"`.
    pub suite: &'static str,
    /// What everything random came from.
    pub seed: u64,
    /// Pictures of each kind of scene.
    pub frames: usize,
    /// Median time of the full-size f32 difference of Gaussians on the red channel, one thread,
    /// milliseconds.
    pub reference_ms: f64,
    /// One for each detector, in the order given.
    pub detectors: Vec<DetectorReport>,
}

/// What one detector did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DetectorReport {
    /// Its name.
    pub name: &'static str,
    /// Median time for a picture, one thread, milliseconds.
    pub median_ms: f64,
    /// That time over `reference_ms`.
    pub ratio: f64,
    /// The same of pictures without a ball, if there were any.
    pub empty_ratio: Option<f64>,
    /// The scene that takes longest, and that of its median.
    pub slowest: Option<(&'static str, f64)>,
    /// From the picture to the bytes for the board (detection, location, encoding), searching, 99th
    /// percentile, milliseconds.
    pub path_p99_ms: f64,
    /// The same for a picture just like the one before: of detectors that look first where the ball
    /// was.
    pub tracking_ratio: f64,
    /// Share of all balls that it hit, 0 to 1.
    pub hit_rate: f64,
    /// Detections that were no hit, in all scenes.
    pub false_alarms: usize,
    /// Mean of the squared errors of position over their covariance, in all scenes: 3 where the
    /// covariance is right.
    pub consistency: Option<f64>,
    /// Scene by scene.
    pub scenes: Vec<SceneReport>,
}

/// What one detector did in one kind of scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneReport {
    /// Which.
    pub scene: &'static str,
    /// Pictures.
    pub frames: usize,
    /// Pictures with a ball.
    pub balls: usize,
    /// Detections within half the ball's radius of its centre.
    pub hits: usize,
    /// Other detections: elsewhere than the ball, or where there is none.
    pub false_alarms: usize,
    /// Median distance of the hits from the ball's projected centre, pixels.
    pub error_median_px: Option<f64>,
    /// 95th percentile of that distance, pixels.
    pub error_p95_px: Option<f64>,
    /// Hits whose position is known.
    pub located: usize,
    /// Median distance of those from the ball's centre, millimetres.
    pub position_median_mm: Option<f64>,
    /// 95th percentile of that distance, millimetres.
    pub position_p95_mm: Option<f64>,
    /// Mean of that error squared over its covariance: 3 where the covariance says how large errors
    /// are.
    pub consistency: Option<f64>,
    /// 95th percentile of the same: 7.8 of a normal distribution.
    pub consistency_p95: Option<f64>,
}
