//! Monitor of the poses: signs that a camera was knocked.

use std::collections::VecDeque;

use super::view::Side;

/// Length of the averages, seconds.
const WINDOW_S: f64 = 0.5;
/// Least number of samples of an average.
const MIN_SAMPLES: usize = 8;
/// Largest mean of the residual, pixels; calibration leaves less than 0.5.
const MAX_RESIDUAL_PX: f64 = 1.0;
/// Largest mean of the radius's error, pixels, from what was learned.
const MAX_RADIUS_PX: f64 = 0.35;
/// Samples are clamped to so many limits: a single wild picture raises no alarm.
const CLAMP: f64 = 3.0;

/// Sign of an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// The rays of the two cameras pass each other.
    Residual,
    /// The outline does not fit the distance at which the rays meet.
    Radius,
    /// Told from outside: [`PairFuser::accuse`](super::PairFuser::accuse).
    Told,
}

/// Alarm: the pose of a camera is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Alarm {
    /// The camera; `None` if it is not known which one.
    pub side: Option<Side>,
    /// Sign of it.
    pub sign: Sign,
}

/// Mean of the samples of the last half second.
#[derive(Debug, Clone)]
struct WindowMean {
    limit: f64,
    /// Stamps, seconds, and clamped values.
    samples: VecDeque<(f64, f64)>,
}

impl WindowMean {
    /// Creates the empty mean, which is exceeded above `limit`.
    fn new(limit: f64) -> Self {
        Self { limit, samples: VecDeque::new() }
    }

    /// Adds a sample. Returns whether the mean exceeds the limit.
    fn add(&mut self, stamp: f64, value: f64) -> bool {
        let clamp = CLAMP * self.limit;
        self.samples.push_back((stamp, value.clamp(-clamp, clamp)));
        // Of a camera with many pictures a second or a wild clock the newest ones count.
        let is_old = |&(t, _): &(f64, f64)| !(stamp - WINDOW_S..=stamp).contains(&t);
        while self.samples.len() > 1000 || self.samples.front().is_some_and(is_old) {
            self.samples.pop_front();
        }
        let sum: f64 = self.samples.iter().map(|(_, value)| value).sum();
        let count = self.samples.len();
        count >= MIN_SAMPLES && sum.abs() > self.limit * count as f64
    }
}

/// Averages of residual and radii.
#[derive(Debug, Clone)]
pub(super) struct Monitor {
    residual: WindowMean,
    radii: [WindowMean; 2],
}

impl Monitor {
    /// Creates the monitor of cameras that have given nothing yet.
    pub(super) fn new() -> Self {
        let radius = || WindowMean::new(MAX_RADIUS_PX);
        Self { residual: WindowMean::new(MAX_RESIDUAL_PX), radii: [radius(), radius()] }
    }

    /// Adds the residual and the errors of the radii (`None` before they are learned), pixels.
    /// Returns the sign of an alarm.
    pub(super) fn add(
        &mut self,
        stamp: f64,
        residual: f64,
        radii: [Option<f64>; 2],
    ) -> Option<Sign> {
        let mut sign = self.residual.add(stamp, residual).then_some(Sign::Residual);
        for (mean, error) in self.radii.iter_mut().zip(radii) {
            if error.is_some_and(|error| mean.add(stamp, error)) {
                sign = sign.or(Some(Sign::Radius));
            }
        }
        sign
    }
}
