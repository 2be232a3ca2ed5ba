//! The detector `ball`: depth and a network propose; edges, depth and two networks decide.
//!
//! The stages are in [`shape`](super::shape).

use super::shape::{
    CandidateTrace, DetectionTrace, Disc, SearchTrace, ShapeParameters, Window, search_window,
};
use super::{BallDetector, DetectError, StageImage};
use crate::camera::Camera;
use crate::debug::draw_stages;
use crate::frame::RgbdFrame;
use crate::localise::observe;
use crate::observation::{BallObservation, Circle};

/// Windows start and end at a multiple of so many pixels: at whole pixels of the network.
const WINDOW_STEP: usize = 16;

/// Finds a ball of known size and hue to a fraction of a pixel, at any distance from
/// `SearchParameters::min_distance` to `max_distance`.
///
/// It finds no ball where nothing of the ball's colour is round and of the right size. The score is
/// 0 to 1; 0.52 and more is a ball. A ball without depth scores 0.9 at most.
#[derive(Debug, Clone)]
pub struct ShapeDetector {
    camera: Camera,
    parameters: ShapeParameters,
    /// The ball in the previous frame.
    previous: Option<Disc>,
}

impl ShapeDetector {
    /// Makes a detector for the ball that `camera` looks for.
    pub fn new(camera: &Camera) -> Self {
        Self::with_parameters(camera, ShapeParameters::DEFAULT)
    }

    /// Makes a detector with other parameters than the default ones.
    pub fn with_parameters(camera: &Camera, parameters: ShapeParameters) -> Self {
        Self { camera: camera.clone(), parameters, previous: None }
    }

    /// Returns the observation of the ball in `frame`, as [`BallDetector::detect`], with what each
    /// stage found.
    pub fn detect_traced(
        &mut self,
        frame: &RgbdFrame,
    ) -> (Option<BallObservation>, DetectionTrace) {
        let trace = self.search_all(frame);
        let best = trace.searches.last().and_then(SearchTrace::best);
        let found = best.filter(|best| best.score() >= self.parameters.search.min_score);
        self.previous = found.map(|found| found.circle.disc);
        let observation = found.map(|found| {
            let Disc { u, v, radius } = found.circle.disc;
            let covariance = found.circle.observed_covariance(&self.parameters.edges);
            let circle = Circle { u, v, radius, covariance };
            observe(circle, found.score(), frame, &self.camera)
        });
        (observation, trace)
    }

    /// Searches a window of a frame.
    fn search(&self, frame: &RgbdFrame, window: Window) -> SearchTrace {
        search_window(frame, window, &self.camera, &self.parameters)
    }

    /// Searches near the previous ball, and the whole image if the ball is not surely there.
    fn search_all(&self, frame: &RgbdFrame) -> DetectionTrace {
        let (width, height) = (frame.colour().width(), frame.colour().height());
        let mut searches = Vec::with_capacity(2);
        if let Some(previous) = &self.previous {
            let near = self.search(frame, self.window(previous, width, height));
            let score = near.best().map(CandidateTrace::score);
            searches.push(near);
            if score.is_some_and(|score| score >= self.parameters.search.min_score_tracked) {
                return DetectionTrace { searches };
            }
        }
        searches.push(self.search(frame, Window { left: 0, top: 0, width, height }));
        DetectionTrace { searches }
    }

    /// Returns the window around the previous ball, in whole pixels of the network.
    fn window(&self, previous: &Disc, width: usize, height: usize) -> Window {
        let reach = self.parameters.search.window.at(previous.radius);
        let step = WINDOW_STEP as f64;
        let low = |x: f64, size: usize| {
            (((x - reach).max(0.0) / step) as usize * WINDOW_STEP).min(size - 1)
        };
        let high = |x: f64, size: usize| {
            (((x + reach).max(0.0) / step) as usize * WINDOW_STEP + WINDOW_STEP).min(size)
        };
        let (left, top) = (low(previous.u, width), low(previous.v, height));
        let (right, bottom) = (high(previous.u, width), high(previous.v, height));
        let (width, height) = (right.saturating_sub(left), bottom.saturating_sub(top));
        Window { left, top, width: width.max(1), height: height.max(1) }
    }
}

impl BallDetector for ShapeDetector {
    fn name(&self) -> &'static str {
        "ball"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        Ok(self.detect_traced(frame).0)
    }

    fn detect_with_stages(
        &mut self,
        frame: &RgbdFrame,
    ) -> Result<(Option<BallObservation>, Vec<StageImage>), DetectError> {
        let (observation, trace) = self.detect_traced(frame);
        let images = draw_stages(frame, &trace, observation.as_ref())?;
        Ok((observation, images))
    }

    fn reset(&mut self) {
        self.previous = None;
    }
}
