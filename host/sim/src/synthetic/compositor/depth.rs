//! Depth of a composited object, as a structured-light sensor measures it.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use super::{Appearance, Compositor, Shear};
use crate::synthetic::room::Object;

/// Depth step of a Kinect or Carmine at 1 m, metres; proportional to the square of the distance.
const DEPTH_STEP: f64 = 0.002_85;
/// Standard deviation of the depth noise at 1 m, metres; proportional to the square of the
/// distance.
const DEPTH_NOISE: f64 = 0.001_2;
/// Distance between camera and projector, metres.
const BASELINE: f64 = 0.075;

impl Compositor {
    /// Sets the depth of `object` in a row, and the projector's shadow to the left of it.
    pub(super) fn set_depths(
        &mut self,
        object: &Object,
        row: i32,
        columns: std::ops::Range<i32>,
        (appearance, shear): (&Appearance, &Shear),
        random: &mut impl Rng,
    ) {
        let mut first: Option<(i32, f64)> = None;
        for column in columns {
            let Some(i) = self.index(column, row) else { continue };
            let at = shear.undo((f64::from(column), f64::from(row)));
            let Some((z, _)) = self.intersect(object, at) else {
                continue;
            };
            first = first.or(Some((column, z)));
            let noise: f64 = random.sample(StandardNormal);
            let lost = object.glow > 0.0 || random.random::<f64>() < appearance.holes;
            self.depth[i] =
                if lost { 0.0 } else { quantised(z + noise * DEPTH_NOISE * z * z) as f32 };
        }
        let Some((first, z)) = first else { return };
        let behind = self.index(first - 2, row).map_or(0.0, |i| f64::from(self.depth[i]));
        let far = if behind > 0.0 { behind } else { 4.0 };
        let width = (self.lens().fx * BASELINE * (1.0 / z - 1.0 / far)).max(0.0) as i32;
        for column in first - width..first {
            if let Some(i) = self.index(column, row) {
                self.depth[i] = 0.0;
            }
        }
    }
}

/// Returns a depth rounded to the sensor's steps of disparity, metres.
fn quantised(z: f64) -> f64 {
    let steps = 1.0 / DEPTH_STEP;
    steps / (steps / z).round().max(1.0)
}
