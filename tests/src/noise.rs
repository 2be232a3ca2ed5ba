//! Noise of a measured position.

use nalgebra::Vector3;
use rand::{Rng, RngExt};

/// Standard deviations of a position, metres: depth, and aside, as in the control benchmarks.
const NOISE_SD_M: [f64; 3] = [0.002, 0.001, 0.001];

/// Returns a normal number: the sum of twelve uniform ones.
pub fn normal(random: &mut impl Rng) -> f64 {
    (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0
}

/// Returns the error of a position, metres.
pub fn position_noise(random: &mut impl Rng) -> Vector3<f64> {
    Vector3::from(NOISE_SD_M.map(|sd| sd * normal(random)))
}
