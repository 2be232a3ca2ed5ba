//! A detector whose positions have a camera's noise, in a frame of any orientation.

use nalgebra::Affine3;
use plumb_vision::detect::{BallDetector, DetectError};
use plumb_vision::frame::RgbdFrame;
use plumb_vision::observation::{BallObservation, Gaussian3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::links::FixedDetector;
use crate::noise::position_noise;

/// Share of pictures in which the ball is not found.
const DROPOUTS: f64 = 0.02;

/// Detector with noise.
pub struct NoisyDetector {
    inner: FixedDetector,
    /// From the rig frame to the frame of the positions.
    seen: Affine3<f64>,
    random: ChaCha8Rng,
}

impl NoisyDetector {
    /// Returns a detector that adds noise from `seed` and maps the positions by `seen`.
    pub fn new(inner: FixedDetector, seen: Affine3<f64>, seed: u64) -> Self {
        Self { inner, seen, random: ChaCha8Rng::seed_from_u64(seed) }
    }
}

impl BallDetector for NoisyDetector {
    fn name(&self) -> &'static str {
        "noisy"
    }

    fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
        let noise = position_noise(&mut self.random);
        let is_lost = self.random.random::<f64>() < DROPOUTS;
        let Some(ball) = self.inner.detect(frame)?.filter(|_| !is_lost) else { return Ok(None) };
        let position = ball
            .position
            .map(|position| Gaussian3 { mean: self.seen * (position.mean + noise), ..position });
        Ok(Some(BallObservation { position, ..ball }))
    }
}
