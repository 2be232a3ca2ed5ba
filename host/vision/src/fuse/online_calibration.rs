//! Calibration by the pairs: the error of each outline's radius, and the difference of the
//! latencies.

use super::line::Line;
use super::monitor::{Monitor, Sign};
use super::view::{Side, View};

/// Largest standard deviation of a circle that is learned from, pixels: the error of a partly
/// covered ball is one for many pictures.
const MAX_DEVIATION_PX: f64 = 0.5;

/// Prior and drift of a radius's error: of the rim (pixels), and of the ball's diameter (share).
const RADIUS_PRIOR: [f64; 2] = [0.3, 0.03];
const RADIUS_DRIFT: [f64; 2] = [0.005, 0.000_1];
/// Standard deviation of what is left of a radius's error, pixels: it differs from place to place.
const RADIUS_REST_PX: f64 = 0.03;
/// Standard deviation from which on a radius's error is known, pixels.
const RADIUS_KNOWN_PX: f64 = 0.1;

/// Prior and drift of the gap between the rays: of the poses (pixels), and of the latencies
/// (seconds).
const LATENCY_PRIOR: [f64; 2] = [0.5, 0.015];
const LATENCY_DRIFT: [f64; 2] = [0.02, 0.000_1];
/// Standard deviation from which on the difference of the latencies is known, seconds.
const LATENCY_KNOWN_S: f64 = 0.001;
/// Largest difference of the latencies that explains a gap, seconds.
const MAX_LATENCY_S: f64 = 0.03;

/// Measurements of a pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct PairSample {
    /// Time of the pair, seconds.
    pub(super) stamp: f64,
    /// Distance between the rays, pixels.
    pub(super) gap: f64,
    /// Its variance, pixels².
    pub(super) gap_variance: f64,
    /// Change of the gap by a later exposure of the second picture, pixels per second.
    pub(super) sensitivity: f64,
    /// Radius of each camera's circle, and of the outline at the pair's position, pixels.
    pub(super) radii: [Option<(f64, f64)>; 2],
}

/// What the pairs have shown so far.
#[derive(Debug, Clone)]
pub(super) struct OnlineCalibration {
    /// Error of the radius by the radius, for each camera, pixels.
    radii: [Line; 2],
    /// Radius of the last circle of each camera, pixels.
    last_radii: [f64; 2],
    /// Gap between the rays by its sensitivity: the slope is the difference of the latencies.
    gap: Line,
    monitor: Monitor,
}

impl OnlineCalibration {
    /// Creates the priors.
    pub(super) fn new() -> Self {
        let radius = || Line::new(RADIUS_PRIOR, RADIUS_DRIFT);
        Self {
            radii: [radius(), radius()],
            last_radii: [0.0; 2],
            gap: Line::new(LATENCY_PRIOR, LATENCY_DRIFT),
            monitor: Monitor::new(),
        }
    }

    /// Returns the error of a camera's outline of `radius` pixels, and its variance.
    pub(super) fn radius(&self, side: Side, radius: f64) -> (f64, f64) {
        let (error, variance) = self.radii[side.index()].at(radius);
        (error, variance + RADIUS_REST_PX * RADIUS_REST_PX)
    }

    /// Returns the error of a camera's outlines as it was last, pixels, if it is known.
    pub(super) fn radius_error(&self, side: Side) -> Option<f64> {
        let (error, variance) = self.radii[side.index()].at(self.last_radii[side.index()]);
        (self.last_radii[side.index()] > 0.0 && variance.sqrt() < RADIUS_KNOWN_PX).then_some(error)
    }

    /// Returns by how much the second camera's stamps are later than the first one's, seconds, if
    /// it is known.
    pub(super) fn latency_difference(&self) -> Option<f64> {
        let (slope, deviation) = self.gap.slope();
        // The exposure is later than the stamp where the stamp is early.
        (deviation < LATENCY_KNOWN_S && slope.abs() < MAX_LATENCY_S).then_some(-slope)
    }

    /// Returns what is added to the stamps of a camera, seconds.
    pub(super) fn stamp_shift(&self, side: Side) -> f64 {
        let half = self.latency_difference().unwrap_or(0.0) / 2.0;
        if side == Side::First { half } else { -half }
    }

    /// Learns from a pair. Returns the sign of an alarm.
    pub(super) fn learn(&mut self, sample: &PairSample, views: &[View; 2]) -> Option<Sign> {
        if views.iter().any(|view| view.deviation() > MAX_DEVIATION_PX) {
            return None;
        }
        let &PairSample { stamp, gap, gap_variance, sensitivity, .. } = sample;
        // As it would be without the compensation, and what no latency explains.
        let compensated = -self.latency_difference().unwrap_or(0.0);
        let gap = gap + sensitivity * compensated;
        let slope = self.gap.slope().0.clamp(-MAX_LATENCY_S, MAX_LATENCY_S);
        let residual = gap - sensitivity * slope;
        self.gap.update(stamp, (sensitivity, gap), gap_variance);
        let errors = Side::BOTH.map(|side| self.learn_radius(side, sample, views));
        self.monitor.add(stamp, residual, errors)
    }

    /// Learns the error of a camera's radius. Returns how far this circle is from what was known.
    fn learn_radius(&mut self, side: Side, sample: &PairSample, views: &[View; 2]) -> Option<f64> {
        let (radius, expected) = sample.radii[side.index()]?;
        let line = &mut self.radii[side.index()];
        let error = radius - expected;
        let (known, variance) = line.at(radius);
        let sample_variance =
            views[side.index()].covariance[(2, 2)] + RADIUS_REST_PX * RADIUS_REST_PX;
        line.update(sample.stamp, (radius, error), sample_variance);
        self.last_radii[side.index()] = radius;
        (variance.sqrt() < RADIUS_KNOWN_PX).then_some(error - known)
    }
}
