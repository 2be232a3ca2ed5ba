//! The suite `hard`: balls composited into recorded frames under difficult conditions, and recorded
//! frames without a ball.

mod ball;

use nalgebra::Vector3;
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::labelled::LabelledFrame;
use super::placer::{Distractor, Placer, Reach};
use super::{BoxedError, FrameSuite, VisionOptions, suite_camera};
use plumb_sim::synthetic::Light;
use plumb_sim::synthetic::compositor::{Compositor, Exposure};

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
    placer: Placer,
    recorded: &'a [RgbdFrame],
    /// Number of frames so far.
    count: usize,
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
        let placer = Placer { camera, random: ChaCha8Rng::seed_from_u64(seed) };
        Self { case, placer, recorded, count: 0 }
    }

    /// Returns the next frame; `None` if there is no recorded frame.
    pub(super) fn next(&mut self) -> Result<Option<LabelledFrame>, BoxedError> {
        if self.recorded.is_empty() {
            return Ok(None);
        }
        let random = &mut self.placer.random;
        let behind = &self.recorded[random.random_range(0..self.recorded.len())];
        let light = self.light();
        let mirrored = self.placer.random.random_bool(0.5);
        let mut compositor = Compositor::new(behind, &self.placer.camera, &light, mirrored);
        let strange = self.case.condition == Condition::ColouredLight;
        let cast = if strange { 0.6..1.5 } else { 0.85..1.15 };
        let random = &mut self.placer.random;
        compositor.tint(std::array::from_fn(|_| random.random_range(cast.clone())));
        let things = match self.case.condition {
            Condition::RedThings => random.random_range(3..7),
            _ => random.random_range(0..3),
        };
        for _ in 0..things {
            self.placer.add_distractor(&mut compositor, &Distractor::SOLID)?;
        }
        let mut ball = None;
        if self.case.ball {
            let half_out = self.case.condition == Condition::HalfOut;
            let place = self.placer.place(&compositor, &Reach { half_out, ..Reach::USUAL });
            ball = Some(self.placer.truth(&place));
            self.add_ball(&mut compositor, &place)?;
        }
        let exposure = self.exposure();
        let time = self.count as f64 / 30.0;
        let frame = compositor.finish(time, &exposure, &mut self.placer.random)?;
        self.count += 1;
        Ok(Some(LabelledFrame { frame, ball }))
    }

    /// Returns a random light.
    fn light(&mut self) -> Light {
        let strange = self.case.condition == Condition::ColouredLight;
        let mut colour = |strength: f64| {
            let spread = if strange { 0.4 } else { 0.12 };
            std::array::from_fn(|_| {
                strength * self.placer.random.random_range(1.0 - spread..1.0 + spread)
            })
        };
        let (key, sky, ground) = (colour(0.7), colour(0.3), colour(0.15));
        let (sin, cos) = self.placer.random.random_range(-1.3_f64..1.3).sin_cos();
        let direction = Vector3::new(cos, sin, self.placer.random.random_range(0.1..1.2));
        Light { direction, key, sky, ground }
    }

    /// Returns a random exposure, sensor noise and depth shift.
    fn exposure(&mut self) -> Exposure {
        let random = &mut self.placer.random;
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
        Exposure { gain, cast: [1.0; 3], defocus: 0.0, noise, shift }
    }
}
