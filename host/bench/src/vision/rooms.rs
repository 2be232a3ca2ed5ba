//! The suite `rooms`: balls in rooms of any colour, with depth, with parts of it, and without. The
//! suite `disc`: flat discs in the same rooms, without depth.
//!
//! Every frame has random numbers of its own, from the seed, the kind and the frame's number. It is
//! therefore the same whichever other frames are made, and in whichever order.

mod interior;
mod kind;
mod readout;

use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use plumb_sim::synthetic::compositor::{Appearance, Compositor, Exposure, Paint};
use plumb_sim::synthetic::{Light, Material, Pattern};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::labelled::LabelledFrame;
use super::placer::{BallPlacement, DIAMETER, Distractor, Placer, Reach};
use super::{BoxedError, FrameSuite, VisionOptions, suite_camera};
use interior::Palette;
pub use kind::FrameGroup;
use kind::{Condition, DepthState};
pub(super) use kind::{DISC_KINDS, KINDS, RoomKind};

/// Number of rendered rooms of each palette.
const INTERIORS: u64 = 6;
/// Share of the frames of most kinds that have a recorded background, if there is one.
const RECORDED_SHARE: f64 = 0.6;
/// Number of backgrounds that are tried until the ball has room.
const MAX_TRIES: usize = 12;
/// Radii of discs, pixels.
const DISC_RADII: Range<f64> = 8.0..60.0;

/// Backgrounds of the suite.
pub(super) struct Backgrounds<'a> {
    recorded: &'a [RgbdFrame],
    usual: Vec<RgbdFrame>,
    reddish: Vec<RgbdFrame>,
    /// Walls of one colour.
    plain: Vec<RgbdFrame>,
}

impl<'a> Backgrounds<'a> {
    /// Renders the rooms.
    pub(super) fn new(
        camera: &Camera,
        recorded: &'a [RgbdFrame],
        options: &VisionOptions,
    ) -> Result<Self, BoxedError> {
        let camera = suite_camera(FrameSuite::Rooms, camera);
        let render = |palette, first: u64| -> Result<Vec<RgbdFrame>, BoxedError> {
            let numbers = first..first + INTERIORS;
            numbers
                .map(|k| interior::picture(palette, &camera, options, stream(options, u32::MAX, k)))
                .collect()
        };
        let usual = render(Palette::Usual, 0)?;
        let [reddish, plain] = match options.suite {
            FrameSuite::Disc => [Vec::new(), render(Palette::Plain, 2 * INTERIORS)?],
            _ => [render(Palette::Reddish, INTERIORS)?, Vec::new()],
        };
        Ok(Self { recorded, usual, reddish, plain })
    }

    /// Returns a random background for frames under `condition`.
    fn draw(&self, condition: Condition, random: &mut ChaCha8Rng) -> &RgbdFrame {
        let recorded = !self.recorded.is_empty() && random.random_bool(RECORDED_SHARE);
        let frames = match condition {
            Condition::ReddishRoom => &self.reddish,
            Condition::Disc { plain: true, .. } => &self.plain,
            _ if recorded => self.recorded,
            _ => &self.usual,
        };
        &frames[random.random_range(0..frames.len())]
    }
}

/// Returns the random numbers of frame `frame` of kind `kind`. Those of the held-out frames are
/// others than those of the rest.
fn stream(options: &VisionOptions, kind: u32, frame: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(options.seed);
    let held_out = u64::from(options.held_out);
    random.set_stream(held_out << 63 | u64::from(kind) << 31 | frame & 0x7fff_ffff);
    random
}

/// Generator of the frames of one kind.
pub(super) struct RoomFrames<'a> {
    kind: RoomKind,
    /// Number of the kind.
    number: u32,
    camera: Camera,
    backgrounds: &'a Backgrounds<'a>,
    options: &'a VisionOptions,
    /// Number of frames so far.
    count: u64,
}

impl<'a> RoomFrames<'a> {
    /// Creates the generator for the kind of number `number`.
    pub(super) fn new(
        (number, kind): (u32, RoomKind),
        camera: &Camera,
        backgrounds: &'a Backgrounds<'a>,
        options: &'a VisionOptions,
    ) -> Self {
        let camera = suite_camera(FrameSuite::Rooms, camera);
        Self { kind, number, camera, backgrounds, options, count: 0 }
    }

    /// Returns the next frame.
    pub(super) fn next(&mut self) -> Result<LabelledFrame, BoxedError> {
        let random = stream(self.options, self.number, self.count);
        let placer = Placer { camera: self.camera.clone(), random };
        let mut frame = RoomFrame { kind: self.kind, placer };
        let labelled = frame.make(self.backgrounds, self.count as f64 / 30.0)?;
        self.count += 1;
        Ok(labelled)
    }
}

/// A frame in progress.
struct RoomFrame {
    kind: RoomKind,
    placer: Placer,
}

impl RoomFrame {
    /// Returns the frame, taken at `time`.
    fn make(&mut self, backgrounds: &Backgrounds, time: f64) -> Result<LabelledFrame, BoxedError> {
        let (mut compositor, place) = self.room_for_ball(backgrounds)?;
        if let Some(paint) = self.paint(&place) {
            compositor.repaint(&paint);
        }
        let mut ball = None;
        if self.kind.ball {
            ball = Some(self.placer.truth(&place));
            match self.kind.condition {
                Condition::Disc { slant, .. } => self.add_disc(&mut compositor, &place, slant)?,
                _ => self.add_ball(&mut compositor, &place)?,
            }
        }
        let exposure = self.exposure();
        let random = &mut self.placer.random;
        let mut frame = compositor.finish(time, &exposure, random)?;
        if self.kind.condition == Condition::StrongJpeg {
            frame = readout::compressed(&frame, random.random_range(8..=25))?;
        }
        let frame = readout::depleted(frame, self.kind.depth, random)?;
        Ok(LabelledFrame { frame, ball })
    }

    /// Returns a background with its objects and a place for the ball in front of all of them.
    fn room_for_ball(
        &mut self,
        backgrounds: &Backgrounds,
    ) -> Result<(Compositor, BallPlacement), BoxedError> {
        let reach = self.reach();
        let mut tries = 0;
        loop {
            let compositor = self.furnished(backgrounds)?;
            let place = self.placer.place(&compositor, &reach);
            tries += 1;
            if place.in_front || !self.kind.ball || tries == MAX_TRIES {
                return Ok((compositor, place));
            }
        }
    }

    /// Returns the distances of the ball.
    fn reach(&mut self) -> Reach {
        let focal = self.placer.camera.intrinsics.fx;
        let distance = |radius: f64| focal * DIAMETER / 2.0 / radius;
        match self.kind.condition {
            Condition::Far => {
                Reach { min_distance: distance(10.0), max_distance: distance(5.0), ..Reach::USUAL }
            }
            Condition::Disc { .. } => {
                let ratio = DISC_RADII.end / DISC_RADII.start;
                let radius =
                    DISC_RADII.start * ratio.powf(self.placer.random.random_range(0.0..1.0));
                let [min_distance, max_distance] = [1.01 * radius, 0.99 * radius].map(distance);
                Reach { min_distance, max_distance, ..Reach::USUAL }
            }
            _ => Reach::USUAL,
        }
    }

    /// Returns a random background with random objects.
    fn furnished(&mut self, backgrounds: &Backgrounds) -> Result<Compositor, BoxedError> {
        let condition = self.kind.condition;
        let behind = backgrounds.draw(condition, &mut self.placer.random);
        let gains = self.illuminant();
        let light = self.light(gains);
        let mirrored = self.placer.random.random_bool(0.5);
        let mut compositor = Compositor::new(behind, &self.placer.camera, &light, mirrored);
        compositor.tint(gains);
        let (things, kinds): (usize, &[Distractor]) = match condition {
            Condition::RedThings => {
                (self.placer.random.random_range(4..9), &Distractor::RED_THINGS)
            }
            Condition::OtherBalls if self.kind.ball => (1, &[Distractor::OtherSize]),
            Condition::OtherBalls => (4, &Distractor::BALLS),
            Condition::Disc { plain: true, .. } => (0, &Distractor::RED_THINGS),
            _ => (self.placer.random.random_range(0..3), &Distractor::RED_THINGS),
        };
        for _ in 0..things {
            for _ in 0..10 {
                if self.placer.add_distractor(&mut compositor, kinds)? {
                    break;
                }
            }
        }
        Ok(compositor)
    }

    /// Returns the colour of the light on everything, order blue, green, red.
    fn illuminant(&mut self) -> [f64; 3] {
        let warm = self.kind.condition == Condition::WarmLight
            || (self.kind.condition == Condition::ReddishRoom
                && self.placer.random.random_bool(0.6));
        let ranges = if warm {
            [0.35..0.65, 0.7..0.92, 1.05..1.3]
        } else {
            [0.88..1.12, 0.92..1.08, 0.88..1.12]
        };
        ranges.map(|range| self.placer.random.random_range(range))
    }

    /// Returns a random light of a colour (blue, green, red).
    fn light(&mut self, illuminant: [f64; 3]) -> Light {
        let random = &mut self.placer.random;
        let mut colour = |strength: f64| {
            let strength = strength * random.random_range(0.8..1.2);
            illuminant.map(|gain| strength * gain * random.random_range(0.93..1.07))
        };
        let (key, sky, ground) = (colour(0.7), colour(0.3), colour(0.15));
        let (sin, cos) = random.random_range(-1.3_f64..1.3).sin_cos();
        let direction = Vector3::new(cos, sin, random.random_range(0.1..1.2));
        Light { direction, key, sky, ground }
    }

    /// Returns reddish paint for the surfaces behind the ball; `None` if the kind has none.
    fn paint(&mut self, place: &BallPlacement) -> Option<Paint> {
        let random = &mut self.placer.random;
        let (patterns, whole): (&[Pattern], f64) = match self.kind.condition {
            Condition::Cloth => (&[Pattern::Cloth, Pattern::Carpet], 0.3),
            Condition::Wood => (&[Pattern::Wood, Pattern::Boards], 0.5),
            Condition::Wall => (&[Pattern::Uneven, Pattern::Mottled], 1.0),
            _ => return None,
        };
        let pattern = patterns[random.random_range(0..patterns.len())];
        let everywhere = random.random_bool(whole);
        let around = place.radius * random.random_range(3.0..12.0);
        let radius = if everywhere { f64::INFINITY } else { around };
        let mut angle = || random.random_range(-0.8..0.8);
        let turn = UnitQuaternion::from_euler_angles(angle(), angle(), angle());
        let aside = 0.4 * around;
        let mut off = |x: f64| x + random.random_range(-aside..aside);
        let centre = (off(place.u), off(place.v));
        Some(Paint { colour: self.reddish(), pattern, turn, centre, radius })
    }

    /// Returns a colour of the ball's hue (linear, order blue, green, red): darker, and mixed with
    /// up to a third of grey.
    fn reddish(&mut self) -> [f64; 3] {
        let red = self.placer.red().colour;
        let random = &mut self.placer.random;
        let (strength, grey) = (random.random_range(0.2..1.0), random.random_range(0.0..0.33));
        let mean = (red[0] + red[1] + red[2]) / 3.0;
        red.map(|x| strength * (x * (1.0 - grey) + mean * grey))
    }

    /// Adds the ball, its cables and what covers it.
    fn add_ball(
        &mut self,
        compositor: &mut Compositor,
        place: &BallPlacement,
    ) -> Result<(), BoxedError> {
        let appearance = self.appearance(place.radius);
        let placer = &mut self.placer;
        placer.add_own_cables(compositor, place);
        let material = placer.ball_material();
        placer.add_sphere(compositor, place, material, &appearance)?;
        if self.kind.condition == Condition::Covered {
            if placer.random.random_bool(0.6) {
                placer.add_post(compositor, place)?;
            } else {
                (0..2).for_each(|_| placer.add_cable(compositor, place, 0.2..0.35));
            }
        }
        Ok(())
    }

    /// Adds a disc of the ball's hue with its cables, `slant` degrees off the line of sight.
    fn add_disc(
        &mut self,
        compositor: &mut Compositor,
        place: &BallPlacement,
        slant: u8,
    ) -> Result<(), BoxedError> {
        let appearance = self.appearance(place.radius);
        let placer = &mut self.placer;
        placer.add_own_cables(compositor, place);
        let material = match placer.camera.ball_hue {
            0.0 => placer.red(),
            hue => Material::ball_of_hue(hue),
        };
        placer.add_disc(compositor, place, (f64::from(slant), material.matt()), &appearance)
    }

    /// Returns the sharpness and motion of a ball of `radius`, pixels.
    fn appearance(&mut self, radius: f64) -> Appearance {
        let random = &mut self.placer.random;
        let (mut motion, mut rolling) = ((0.0, 0.0), 0.0);
        if self.kind.condition == Condition::RollingMotion {
            let (sin, cos) = random.random_range(0.0..std::f64::consts::TAU).sin_cos();
            let way = radius * random.random_range(0.25..0.9);
            (motion, rolling) = ((way * cos, way * sin), random.random_range(0.7..2.0));
        }
        let (blur, linear) = (random.random_range(0.4..0.8), random.random_bool(0.5));
        Appearance { blur, motion, rolling, holes: 0.03, linear }
    }

    /// Returns a random exposure, sensor noise and depth shift.
    fn exposure(&mut self) -> Exposure {
        let condition = self.kind.condition;
        let random = &mut self.placer.random;
        let gain = match condition {
            Condition::Dim => random.random_range(0.06..0.3),
            Condition::Bright => random.random_range(1.5..3.0),
            _ if !self.kind.ball => random.random_range(0.4..1.8),
            _ => random.random_range(0.8..1.2),
        };
        let noise = match condition {
            Condition::Noisy => random.random_range(6.0..20.0),
            _ => random.random_range(1.0..3.0),
        };
        let cast = match condition {
            Condition::ColourCast => std::array::from_fn(|_| random.random_range(0.5..1.6)),
            _ => [1.0; 3],
        };
        let defocus = match condition {
            Condition::Blurred => random.random_range(1.0..3.0),
            _ => 0.0,
        };
        let shift = match self.kind.depth {
            DepthState::Shifted => [(4, 0), (-4, 0), (0, 4), (0, -4)][random.random_range(0..4)],
            _ => (0, 0),
        };
        Exposure { gain, cast, defocus, noise, shift }
    }
}
