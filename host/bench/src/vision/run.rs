//! Runs the detectors over the frames.

use std::hint::black_box;

use plumb_config::error_chain::ErrorChain;
use plumb_protocol::frame::{Frame, encode};
use plumb_protocol::message::{Command, Position, ToBoard};
use plumb_protocol::units as wire;
use plumb_vision::detect::BallDetector;
use plumb_vision::observation::{BallObservation, Gaussian3};

use super::labelled::LabelledFrame;
use super::stats::{DetectorStats, FrameTime, percentile};
use super::suites::{FrameKind, NextFrame};
use super::timing::{computed, milliseconds, red_difference_of_gaussians};
use super::{BoxedError, VisionOptions, VisionReport};

/// Number of frames for each timing of the reference.
const REFERENCE_INTERVAL: usize = 4;

/// A comparison in progress.
pub(super) struct Comparison<'a> {
    options: &'a VisionOptions,
    /// Callback with the name of each scene.
    progress: &'a mut dyn FnMut(&str),
    detectors: &'a mut [Box<dyn BallDetector>],
    stats: Vec<DetectorStats>,
    /// Times of the reference, milliseconds.
    reference: Vec<f64>,
    /// Number of frames so far.
    count: usize,
}

impl<'a> Comparison<'a> {
    /// Creates the comparison.
    pub(super) fn new(
        options: &'a VisionOptions,
        progress: &'a mut dyn FnMut(&str),
        detectors: &'a mut [Box<dyn BallDetector>],
    ) -> Self {
        let stats = detectors.iter().map(|_| DetectorStats::default()).collect();
        Self { options, progress, detectors, stats, reference: Vec::new(), count: 0 }
    }

    /// Runs the frames of one kind.
    pub(super) fn run(
        &mut self,
        FrameKind { name, group, count }: FrameKind,
        next: &mut NextFrame,
    ) -> Result<(), BoxedError> {
        (self.progress)(name);
        for _ in 0..count {
            let Some(labelled) = next()? else { break };
            self.round(&labelled, name)?;
        }
        self.stats.iter_mut().for_each(|stats| stats.end_scene(name, group));
        Ok(())
    }

    /// Runs every detector, and the reference at times, on one frame and measures their times.
    fn round(&mut self, labelled: &LabelledFrame, name: &'static str) -> Result<(), BoxedError> {
        if self.count.is_multiple_of(REFERENCE_INTERVAL) {
            let start = computed();
            red_difference_of_gaussians(&labelled.frame)?;
            self.reference.push(milliseconds(start));
        }
        self.count += 1;
        for (detector, stats) in self.detectors.iter_mut().zip(&mut self.stats) {
            let detector_name = detector.name();
            let failed = |error| {
                format!("detector {detector_name}, scene \"{name}\": {}", ErrorChain(&error))
            };
            detector.reset();
            let start = computed();
            let found = detector.detect(&labelled.frame).map_err(failed)?;
            let ms = milliseconds(start);
            stats.times().searching.push(FrameTime { ms, ball: labelled.ball.is_some() });
            let sent = black_box(message(found.as_ref()));
            stats.times().path.extend(sent.map(|_| milliseconds(start)));
            stats.add(labelled, found);
            if found.is_some() {
                let start = computed();
                detector.detect(&labelled.frame).map_err(failed)?;
                stats.times().tracking.push(milliseconds(start));
            }
        }
        Ok(())
    }

    /// Returns the report of all frames.
    pub(super) fn report(mut self) -> VisionReport {
        let VisionOptions { seed, frames, .. } = *self.options;
        let reference_ms = percentile(&mut self.reference, 0.5).unwrap_or(0.0);
        let detectors = self
            .detectors
            .iter()
            .zip(self.stats)
            .map(|(detector, stats)| stats.report(detector.name(), reference_ms))
            .collect();
        VisionReport { suite: "vision", seed, frames, reference_ms, detectors }
    }
}

/// Returns the encoded position command for a detection.
fn message(found: Option<&BallObservation>) -> Option<Frame> {
    let position: Option<&Gaussian3> = found.and_then(|found| found.position.as_ref());
    let ball = position.and_then(|p| wire::Point::from_metres(p.mean.into()));
    let covariance =
        position.and_then(|p| wire::Covariance::from_metres2(p.covariance.transpose().into()));
    let command = Command::Position(Position { sequence: 1, age_us: 30_000, ball, covariance });
    encode(&ToBoard { id: 1, command }).ok()
}
