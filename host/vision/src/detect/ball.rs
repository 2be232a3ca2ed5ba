//! The detector `ball`: depth and a network propose; edges, depth and two networks decide.
//!
//! The stages are in [`shape`](super::shape).

use super::shape::{
    CandidateTrace, DetectionTrace, Disc, SearchParameters, SearchTrace, ShapeParameters, Window,
    search_window,
};
use super::{BallDetector, DetectError, StageImage};
use crate::camera::{Camera, Intrinsics};
use crate::debug::draw_stages;
use crate::frame::RgbdFrame;
use crate::image::Bgr;
use crate::localise::{localise, observe, two_depths};
use crate::observation::{BallObservation, Circle, TwoDepths};

/// Windows start and end at a multiple of so many pixels: at whole pixels of the network.
const WINDOW_STEP: usize = 16;

/// Largest relative error of an outline whose size is compared with the depth.
const MAX_RADIUS_ERROR: f64 = 0.03;

/// Largest residual of its edges, over the usual one. Where others of its colour are beside the
/// ball, edges are found too far outwards: by 7 % of a radius of 17 pixels at twice the usual
/// residual (`plumb demo --virtual-time --law interval --seed 7`), by less than 1 % at the usual
/// one.
const MAX_RMS: f64 = 1.0;

/// Part of a ball's radius within which it is painted over, in the search for another one.
const HIDDEN: f64 = 1.3;

/// Colour that it is painted over with.
const GREY: Bgr = [128; 3];

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
            let free_fit = found.decision.as_ref().and_then(|decision| decision.free_fit);
            let free_fit =
                free_fit.filter(|fit| fit.radius_error < MAX_RADIUS_ERROR && fit.rms < MAX_RMS);
            let ball = observe(circle, found.score(), frame, &self.camera);
            let with_depth = ball.position.filter(|_| frame.intrinsics().has_depth());
            let depths = with_depth.zip(free_fit).and_then(|(position, fit)| {
                let camera = (frame.intrinsics(), &self.camera);
                two_depths(&circle, fit.radius, &position, camera)
            });
            BallObservation { depths, ..ball }
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

    fn has_rival(&self, frame: &RgbdFrame, ball: &BallObservation) -> Result<bool, DetectError> {
        let (mut colour, mut depth) = (frame.colour().clone(), frame.depth().clone());
        let width = colour.width();
        let pixels = colour.pixels_mut().iter_mut().zip(depth.pixels_mut());
        for (i, (colour, depth)) in pixels.enumerate() {
            let (u, v) = ((i % width) as f64 - ball.circle.u, (i / width) as f64 - ball.circle.v);
            if u.hypot(v) < HIDDEN * ball.circle.radius {
                (*colour, *depth) = (GREY, 0);
            }
        }
        let rest = RgbdFrame::new(frame.time(), colour, depth, *frame.intrinsics());
        let mut detector = Self { previous: None, ..self.clone() };
        let rival = detector.detect(&rest.map_err(DetectError::processing)?)?;
        // Beyond that score no candidate is much better.
        let SearchParameters { certain_score, rival_log_odds, .. } = self.parameters.search;
        let log_odds = |score: f64| {
            let score = score.min(certain_score);
            (score / (1.0 - score)).ln()
        };
        let least = log_odds(ball.score) - rival_log_odds;
        Ok(rival.is_some_and(|rival| log_odds(rival.score) >= least))
    }

    fn compare_depths(&self, frame: &RgbdFrame) -> Result<Option<TwoDepths>, DetectError> {
        let intrinsics = Intrinsics { depth_scale: 0.0, ..*frame.intrinsics() };
        let (colour, depth) = (frame.colour().clone(), frame.depth().clone());
        let flat = RgbdFrame::new(frame.time(), colour, depth, intrinsics);
        let mut detector = Self { previous: None, ..self.clone() };
        let found = detector.detect(&flat.map_err(DetectError::processing)?)?;
        let circle = found.map(|ball| ball.circle).filter(is_sure_of_size);
        Ok(circle.and_then(|circle| {
            let position = localise(&circle, frame, &self.camera)?;
            two_depths(&circle, circle.radius, &position, (frame.intrinsics(), &self.camera))
        }))
    }

    fn reset(&mut self) {
        self.previous = None;
    }
}

/// Returns whether the size of a circle without depth is sure enough to be compared with depth.
fn is_sure_of_size(circle: &Circle) -> bool {
    circle.covariance[(2, 2)].sqrt() < MAX_RADIUS_ERROR * circle.radius
}
