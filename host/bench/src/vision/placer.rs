//! Random places for balls and other objects in composited frames.

mod ball;
mod clutter;
mod distractor;

use nalgebra::Point3;
use plumb_sim::synthetic::compositor::Compositor;
use plumb_vision::camera::Camera;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::labelled::GroundTruth;
pub(super) use distractor::Distractor;

/// Diameter of the composited balls, metres.
pub(super) const DIAMETER: f64 = 0.06;

/// Source of random objects and their places before a camera.
pub(super) struct Placer {
    /// Camera of the frames.
    pub(super) camera: Camera,
    /// Random numbers of the frames.
    pub(super) random: ChaCha8Rng,
}

/// Range of the places of a ball.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    /// Least distance along the optical axis, metres.
    pub(super) min_distance: f64,
    /// Greatest distance along the optical axis, metres.
    pub(super) max_distance: f64,
    /// Whether about half of the ball lies outside the frame.
    pub(super) half_out: bool,
}

impl Reach {
    /// The distances that a Kinect or Carmine measures well: radii of 35 to 8 pixels.
    pub(super) const USUAL: Self = Self { min_distance: 0.45, max_distance: 1.9, half_out: false };
}

/// Position of a ball in a frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct BallPlacement {
    /// Column, pixels.
    pub(super) u: f64,
    /// Row, pixels.
    pub(super) v: f64,
    /// Distance along the optical axis, metres.
    pub(super) z: f64,
    /// Radius, pixels.
    pub(super) radius: f64,
    /// Whether it is in front of everything that it covers.
    pub(super) in_front: bool,
}

impl Placer {
    /// Returns a random position of the ball in front of everything that it covers. If 60 tries
    /// find none, returns the last one.
    pub(super) fn place(&mut self, compositor: &Compositor, reach: &Reach) -> BallPlacement {
        let lens = self.camera.intrinsics;
        let (width, height) = (2.0 * lens.cx + 1.0, 2.0 * lens.cy + 1.0);
        let at = |random: &mut ChaCha8Rng, radius: f64, half_out: bool| {
            let margin = 1.3 * radius + 4.0;
            let (u, v) = (
                random.random_range(margin..width - margin),
                random.random_range(margin..height - margin),
            );
            let out = radius * random.random_range(0.0..0.6);
            match random.random_range(0..4) {
                _ if !half_out => (u, v),
                0 => (out, v),
                1 => (width - 1.0 - out, v),
                2 => (u, out),
                _ => (u, height - 1.0 - out),
            }
        };
        let nearest = reach.min_distance;
        let mut last = self.placement(lens.cx, lens.cy, nearest);
        for attempt in 0..60 {
            let mut z = self.random.random_range(nearest..reach.max_distance);
            let radius = lens.fx * DIAMETER / 2.0 / z;
            let (u, v) = at(&mut self.random, radius, reach.half_out);
            let free = compositor.nearest((u, v), 1.2 * radius) - DIAMETER / 2.0 - 0.01;
            if attempt > 25 {
                z = z.min(free).max(nearest);
            }
            last = self.placement(u, v, z);
            if z <= free {
                return BallPlacement { in_front: true, ..last };
            }
        }
        last
    }

    /// Returns the placement of a ball at a pixel and a depth (metres).
    fn placement(&self, u: f64, v: f64, z: f64) -> BallPlacement {
        let radius = self.camera.intrinsics.fx * DIAMETER / 2.0 / z;
        BallPlacement { u, v, z, radius, in_front: false }
    }

    /// Returns the truth about a ball at `place`.
    pub(super) fn truth(&self, place: &BallPlacement) -> GroundTruth {
        let &BallPlacement { u, v, z, radius, .. } = place;
        GroundTruth { u, v, radius, centre: self.deproject(u, v, z) }
    }

    /// Returns the point (rig frame, metres) of a pixel at depth `z`, metres.
    pub(super) fn deproject(&self, u: f64, v: f64, z: f64) -> Point3<f64> {
        self.camera.pose * self.camera.intrinsics.deproject(u, v, z)
    }
}
