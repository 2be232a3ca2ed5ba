//! The detector `disc`: a flat disc, seen as an ellipse by a camera without depth.
//!
//! How it is found is in `shape/flat_disc.rs`.

use super::shape::{DetectionTrace, FlatDisc, SearchParameters, find_discs};
use super::{BallDetector, DetectError, StageImage};
use crate::camera::Camera;
use crate::debug::draw_stages;
use crate::frame::RgbdFrame;
use crate::localise::observe;
use crate::observation::{BallObservation, Circle};

/// Part of the score of the disc from which on another disc is its rival.
const RIVAL_SCORE: f64 = 0.85;

/// Finds a flat disc of known diameter and hue at a slant of up to 50 degrees, for a camera without
/// depth.
///
/// The circle of its observations has the centre of the ellipse and its larger half axis as radius,
/// which is that of the disc at no slant. The covariance of the centre includes the distance from
/// the centre of the ellipse to the picture of the disc's centre, which perspective makes: r²/f q
/// √(1 - q²) pixels along the smaller half axis, for the larger one r, the focal length f and the
/// ratio q of both. The score is 0 to 0.9; 0.52 and more is a disc. With depth the detector
/// [`ball`](super::ball) does not take a disc for the ball; this one is not meant for it.
#[derive(Debug, Clone)]
pub struct DiscDetector {
    camera: Camera,
    /// Least score of a disc, 0 to 1.
    min_score: f64,
}

impl DiscDetector {
    /// Makes a detector for a disc with the diameter and hue of the ball of `camera`.
    pub fn new(camera: &Camera) -> Self {
        Self { camera: camera.clone(), min_score: SearchParameters::DEFAULT.min_score }
    }

    /// Returns the discs in a frame, the one with the highest score first.
    fn discs(&self, frame: &RgbdFrame) -> Result<Vec<FlatDisc>, DetectError> {
        let mut discs = find_discs(frame, &self.camera).map_err(DetectError::processing)?;
        discs.retain(|found| found.score >= self.min_score);
        Ok(discs)
    }
}

impl BallDetector for DiscDetector {
    fn name(&self) -> &'static str {
        "disc"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        Ok(self.discs(frame)?.first().map(|found| {
            let (disc, covariance) = (found.disc, found.covariance);
            let circle = Circle { u: disc.u, v: disc.v, radius: disc.radius, covariance };
            observe(circle, found.score, frame, &self.camera)
        }))
    }

    /// Returns one image: the result.
    fn detect_with_stages(
        &mut self,
        frame: &RgbdFrame,
    ) -> Result<(Option<BallObservation>, Vec<StageImage>), DetectError> {
        let observation = self.detect(frame)?;
        let images = draw_stages(frame, &DetectionTrace::default(), observation.as_ref())?;
        Ok((observation, images))
    }

    fn has_rival(&self, frame: &RgbdFrame, ball: &BallObservation) -> Result<bool, DetectError> {
        let is_apart = |found: &FlatDisc| {
            let off = (found.disc.u - ball.circle.u).hypot(found.disc.v - ball.circle.v);
            off > ball.circle.radius && found.score >= RIVAL_SCORE * ball.score
        };
        Ok(self.discs(frame)?.iter().any(is_apart))
    }
}
