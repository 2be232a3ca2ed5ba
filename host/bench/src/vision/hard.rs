//! The suite `hard`: balls composited into recorded frames under difficult conditions, and recorded
//! frames without a ball.

mod ball;
mod clutter;
mod distractor;

use nalgebra::{Point3, Vector3};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::labelled::{GroundTruth, LabelledFrame};
use super::{FrameSuite, VisionError, VisionOptions, suite_camera};
use plumb_sim::synthetic::Light;
use plumb_sim::synthetic::compositor::{Compositor, Exposure};

/// Diameter of the ball, metres.
pub(super) const DIAMETER: f64 = 0.06;
/// Least distance of the ball along the optical axis, metres.
const MIN_DISTANCE: f64 = 0.45;
/// Greatest distance of the ball along the optical axis, metres.
const MAX_DISTANCE: f64 = 1.9;

/// Difficulty of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Condition {
    None,
    /// Exposure of 0.06 to 0.3.
    Dim,
    /// Exposure of 1.5 to 3.
    Bright,
    /// Defocus.
    Blurred,
    /// Motion blur.
    Moving,
    /// A cable across the ball.
    Cable,
    /// Two thick cables across the ball.
    TwoCables,
    /// A post in front of an eighth to a half of the ball.
    Post,
    /// Colour noise of 6 to 20 of 255.
    Noisy,
    /// About half of the ball outside the frame.
    HalfOut,
    /// 30 to 70 % of the ball without depth.
    HolesInDepth,
    /// The whole ball without depth.
    NoDepth,
    /// Depth shifted against colour.
    ShiftedDepth,
    /// An object that touches the ball.
    Touching,
    /// Red objects around the ball.
    RedThings,
    /// Coloured light.
    ColouredLight,
}

/// A kind of frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct HardCase {
    pub(super) name: &'static str,
    condition: Condition,
    pub(super) ball: bool,
}

const fn with(name: &'static str, condition: Condition) -> HardCase {
    HardCase { name, condition, ball: true }
}

/// Every kind in the order of the report.
pub(super) const CASES: [HardCase; 19] = [
    with("plain", Condition::None),
    with("dim", Condition::Dim),
    with("bright", Condition::Bright),
    with("coloured light", Condition::ColouredLight),
    with("out of focus", Condition::Blurred),
    with("moving", Condition::Moving),
    with("a cable across", Condition::Cable),
    with("two thick cables across", Condition::TwoCables),
    with("behind a post", Condition::Post),
    with("noisy", Condition::Noisy),
    with("half out of the picture", Condition::HalfOut),
    with("holes in its depth", Condition::HolesInDepth),
    with("no depth on it", Condition::NoDepth),
    with("depth shifted", Condition::ShiftedDepth),
    with("something touches it", Condition::Touching),
    with("red things about it", Condition::RedThings),
    HardCase { ball: false, ..with("no ball", Condition::None) },
    HardCase { ball: false, ..with("no ball: coloured light", Condition::ColouredLight) },
    HardCase { ball: false, ..with("no ball: red things", Condition::RedThings) },
];

/// Generator of the frames of one kind.
pub(super) struct HardFrames<'a> {
    case: HardCase,
    camera: Camera,
    recorded: &'a [RgbdFrame],
    random: ChaCha8Rng,
    /// Number of frames so far.
    count: usize,
}

/// Position of a ball in a frame.
#[derive(Clone, Copy)]
struct BallPlacement {
    /// Column, pixels.
    u: f64,
    /// Row, pixels.
    v: f64,
    /// Distance along the optical axis, metres.
    z: f64,
    /// Radius, pixels.
    radius: f64,
}

impl<'a> HardFrames<'a> {
    /// Creates the generator for the kind of number `number` on the `recorded` frames.
    pub(super) fn new(
        (number, case): (u64, HardCase),
        camera: &Camera,
        recorded: &'a [RgbdFrame],
        options: &VisionOptions,
    ) -> Self {
        let seed = options.seed.wrapping_mul(1000).wrapping_add(500 + number);
        let camera = suite_camera(FrameSuite::Hard, camera);
        Self { case, camera, recorded, random: ChaCha8Rng::seed_from_u64(seed), count: 0 }
    }

    /// Returns the next frame; `None` if there is no recorded frame.
    pub(super) fn next(&mut self) -> Result<Option<LabelledFrame>, VisionError> {
        if self.recorded.is_empty() {
            return Ok(None);
        }
        let behind = &self.recorded[self.random.random_range(0..self.recorded.len())];
        let (light, mirrored) = (self.light(), self.random.random_bool(0.5));
        let mut compositor = Compositor::new(behind, &self.camera, &light, mirrored);
        let strange = self.case.condition == Condition::ColouredLight;
        let cast = if strange { 0.6..1.5 } else { 0.85..1.15 };
        compositor.tint(std::array::from_fn(|_| self.random.random_range(cast.clone())));
        let things = match self.case.condition {
            Condition::RedThings => self.random.random_range(3..7),
            _ => self.random.random_range(0..3),
        };
        for _ in 0..things {
            self.add_distractor(&mut compositor)?;
        }
        let mut ball = None;
        if self.case.ball {
            let place = self.place(&compositor);
            let centre = self.deproject(place.u, place.v, place.z);
            ball = Some(GroundTruth { u: place.u, v: place.v, radius: place.radius, centre });
            self.add_ball(&mut compositor, &place)?;
        }
        let exposure = self.exposure();
        let frame = compositor.finish(self.count as f64 / 30.0, &exposure, &mut self.random)?;
        self.count += 1;
        Ok(Some(LabelledFrame { frame, ball }))
    }

    /// Returns a random light.
    fn light(&mut self) -> Light {
        let strange = self.case.condition == Condition::ColouredLight;
        let mut colour = |strength: f64| {
            let spread = if strange { 0.4 } else { 0.12 };
            std::array::from_fn(|_| strength * self.random.random_range(1.0 - spread..1.0 + spread))
        };
        let (key, sky, ground) = (colour(0.7), colour(0.3), colour(0.15));
        let (sin, cos) = self.random.random_range(-1.3_f64..1.3).sin_cos();
        let direction = Vector3::new(cos, sin, self.random.random_range(0.1..1.2));
        Light { direction, key, sky, ground }
    }

    /// Returns a random exposure, sensor noise and depth shift.
    fn exposure(&mut self) -> Exposure {
        let random = &mut self.random;
        let gain = match self.case.condition {
            Condition::Dim => random.random_range(0.06..0.3),
            Condition::Bright => random.random_range(1.5..3.0),
            _ if !self.case.ball => random.random_range(0.4..1.8),
            _ => 1.0,
        };
        let noise = match self.case.condition {
            Condition::Noisy => random.random_range(6.0..20.0),
            _ => random.random_range(1.0..3.0),
        };
        let shift = match self.case.condition {
            Condition::ShiftedDepth => (random.random_range(-3..=3), random.random_range(-2..=2)),
            _ => (0, 0),
        };
        Exposure { gain, noise, shift }
    }

    /// Returns a random position of the ball in front of everything that it covers. If 60 tries
    /// find none, returns the last one.
    fn place(&mut self, compositor: &Compositor) -> BallPlacement {
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
        let mut last = BallPlacement {
            u: lens.cx,
            v: lens.cy,
            z: MIN_DISTANCE,
            radius: lens.fx * DIAMETER / 2.0 / MIN_DISTANCE,
        };
        for attempt in 0..60 {
            let mut z = self.random.random_range(MIN_DISTANCE..MAX_DISTANCE);
            let radius = lens.fx * DIAMETER / 2.0 / z;
            let (u, v) = at(&mut self.random, radius, self.case.condition == Condition::HalfOut);
            let free = compositor.nearest((u, v), 1.2 * radius) - DIAMETER / 2.0 - 0.01;
            if attempt > 25 {
                z = z.min(free).max(MIN_DISTANCE);
            }
            last = BallPlacement { u, v, z, radius: lens.fx * DIAMETER / 2.0 / z };
            if z <= free {
                return last;
            }
        }
        last
    }

    /// Returns the point (rig frame, metres) of a pixel at depth `z`, metres.
    fn deproject(&self, u: f64, v: f64, z: f64) -> Point3<f64> {
        self.camera.pose * self.camera.intrinsics.deproject(u, v, z)
    }
}
