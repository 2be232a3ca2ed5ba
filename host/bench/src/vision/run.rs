//! The detectors run over the pictures.

use std::hint::black_box;

use plumb_protocol::frame::{Frame, encode};
use plumb_protocol::message::{Command, Position, ToBoard};
use plumb_protocol::units as wire;
use plumb_vision::camera::Camera;
use plumb_vision::detect::BallDetector;
use plumb_vision::frame::RgbdFrame;
use plumb_vision::observation::{BallObservation, Gaussian3};

use super::hard::{self, HardShots};
use super::scenes::{self, Backdrop, KINDS, Kind, Shot, Shots};
use super::tally::{Tally, percentile};
use super::timing::{computed, milliseconds, red_difference_of_gaussians};
use super::{FrameSuite, VisionError, VisionOptions, VisionReport};
use plumb_sim::synthetic::SyntheticCamera;

/// The reference is timed on the first of so many pictures.
const REFERENCE_EVERY: usize = 4;

/// Detectors and what they have done so far.
pub(super) struct Bench<'a> {
    camera: &'a Camera,
    recorded: &'a [RgbdFrame],
    options: &'a VisionOptions,
    /// Is told the name of each scene.
    progress: &'a mut dyn FnMut(&str),
    detectors: Vec<&'a mut Box<dyn BallDetector>>,
    tallies: Vec<Tally>,
    /// Times of the reference, milliseconds.
    reference: Vec<f64>,
    pictures: usize,
}

impl<'a> Bench<'a> {
    /// Detectors that have done nothing yet.
    pub(super) fn new(
        camera: &'a Camera,
        recorded: &'a [RgbdFrame],
        options: &'a VisionOptions,
        progress: &'a mut dyn FnMut(&str),
        detectors: Vec<&'a mut Box<dyn BallDetector>>,
    ) -> Self {
        let tallies = detectors.iter().map(|_| Tally::default()).collect();
        Self {
            camera,
            recorded,
            options,
            progress,
            detectors,
            tallies,
            reference: Vec::new(),
            pictures: 0,
        }
    }

    /// The suite `scenes`, or what of it has no ball.
    pub(super) fn scenes(&mut self) -> Result<(), VisionError> {
        let (camera, recorded, options) = (self.camera, self.recorded, self.options);
        let mut known: Vec<(Backdrop, Vec<SyntheticCamera>)> = Vec::new();
        for (number, kind) in (0..).zip(KINDS) {
            let unwanted = kind.ball && options.suite == FrameSuite::Empty;
            if unwanted || (kind.backdrop == Backdrop::Recorded && recorded.is_empty()) {
                continue;
            }
            (self.progress)(kind.name);
            if !known.iter().any(|(backdrop, _)| *backdrop == kind.backdrop) {
                known.push((
                    kind.backdrop,
                    scenes::cameras(kind.backdrop, camera, recorded, options)?,
                ));
            }
            let cameras = known.iter().find(|(backdrop, _)| *backdrop == kind.backdrop);
            let cameras = cameras.map(|(_, cameras)| cameras.clone()).unwrap_or_default();
            let mut shots = Shots::new((number, kind), cameras, recorded, options);
            self.run(kind.name, count(&kind, options), &mut || shots.next())?;
        }
        Ok(())
    }

    /// The suite `hard`, or what of it has no ball.
    pub(super) fn hard(&mut self) -> Result<(), VisionError> {
        let (camera, recorded, options) = (self.camera, self.recorded, self.options);
        for (number, kind) in (0..).zip(hard::KINDS) {
            if kind.ball && options.suite == FrameSuite::Empty {
                continue;
            }
            (self.progress)(kind.name);
            let mut shots = HardShots::new((number, kind), camera, recorded, options);
            let count = if kind.ball { options.frames } else { options.empty };
            self.run(kind.name, count, &mut || shots.next())?;
        }
        Ok(())
    }

    /// Up to `count` pictures of one kind.
    fn run(
        &mut self,
        name: &'static str,
        count: usize,
        next: &mut dyn FnMut() -> Result<Option<Shot>, VisionError>,
    ) -> Result<(), VisionError> {
        self.tallies.iter_mut().for_each(Tally::open);
        for _ in 0..count {
            let Some(shot) = next()? else { break };
            self.round(&shot, name)?;
        }
        self.tallies.iter_mut().for_each(|tally| tally.close(name));
        Ok(())
    }

    /// One picture to the reference (not to each) and to every detector, each timed.
    fn round(&mut self, shot: &Shot, name: &'static str) -> Result<(), VisionError> {
        if self.pictures.is_multiple_of(REFERENCE_EVERY) {
            let start = computed();
            red_difference_of_gaussians(&shot.frame)?;
            self.reference.push(milliseconds(start));
        }
        self.pictures += 1;
        for (detector, tally) in self.detectors.iter_mut().zip(&mut self.tallies) {
            let of = detector.name();
            let failed = |error| VisionError::Detect { name: of, scene: name, error };
            detector.reset();
            let start = computed();
            let found = detector.detect(&shot.frame).map_err(failed)?;
            tally.times.push((milliseconds(start), shot.ball.is_some()));
            let sent = black_box(message(found.as_ref()));
            tally.path_times.extend(sent.map(|_| milliseconds(start)));
            tally.note(shot, found);
            if found.is_some() {
                let start = computed();
                detector.detect(&shot.frame).map_err(failed)?;
                tally.tracking_times.push(milliseconds(start));
            }
        }
        Ok(())
    }

    pub(super) fn report(mut self) -> VisionReport {
        let VisionOptions { seed, frames, .. } = *self.options;
        let reference_ms = percentile(&mut self.reference, 0.5).unwrap_or(0.0);
        let detectors = self
            .detectors
            .iter()
            .zip(self.tallies)
            .map(|(detector, tally)| tally.report(detector.name(), reference_ms))
            .collect();
        VisionReport { suite: "vision", seed, frames, reference_ms, detectors }
    }
}

/// The bytes that tell the board where the ball is.
fn message(found: Option<&BallObservation>) -> Option<Frame> {
    let position: Option<&Gaussian3> = found.and_then(|found| found.position.as_ref());
    let ball = position.and_then(|p| wire::Point::from_metres(p.mean.into()));
    let covariance =
        position.and_then(|p| wire::Covariance::from_metres2(p.covariance.transpose().into()));
    let command = Command::Position(Position { sequence: 1, age_us: 30_000, ball, covariance });
    encode(&ToBoard { id: 1, command }).ok()
}

fn count(kind: &Kind, options: &VisionOptions) -> usize {
    match kind.ball {
        false => options.empty,
        true if kind.backdrop == Backdrop::Recorded => options.recorded_balls,
        true => options.frames,
    }
}
