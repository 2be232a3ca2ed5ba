//! The harder set: balls ray-traced into real pictures, in front of what is there, with what spoils
//! the view, among red things; and pictures without a ball, the same and with their light and
//! colours changed.

use nalgebra::{Point3, Vector3};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::scenes::Shot;
use super::{FrameSuite, VisionError, VisionOptions, suite_camera};
use plumb_sim::synthetic::overlay::{Exposure, Look, Overlay};
use plumb_sim::synthetic::{Light, Material, Pattern, Shape, Thing};

/// The ball of this set, metres.
pub(super) const DIAMETER: f64 = 0.06;
/// Distances that it is at, metres.
const DISTANCES: (f64, f64) = (0.45, 1.9);

/// What spoils the view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trouble {
    None,
    Dim,
    Bright,
    Blurred,
    Moving,
    Cable,
    TwoCables,
    Post,
    Noisy,
    HalfOut,
    HolesInDepth,
    NoDepth,
    ShiftedDepth,
    Touching,
    RedThings,
    ColouredLight,
}

/// A kind of picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kind {
    pub(super) name: &'static str,
    trouble: Trouble,
    pub(super) ball: bool,
}

const fn with(name: &'static str, trouble: Trouble) -> Kind {
    Kind { name, trouble, ball: true }
}

/// Every kind, in the order of the table.
pub(super) const KINDS: [Kind; 19] = [
    with("plain", Trouble::None),
    with("dim", Trouble::Dim),
    with("bright", Trouble::Bright),
    with("coloured light", Trouble::ColouredLight),
    with("out of focus", Trouble::Blurred),
    with("moving", Trouble::Moving),
    with("a cable across", Trouble::Cable),
    with("two thick cables across", Trouble::TwoCables),
    with("behind a post", Trouble::Post),
    with("noisy", Trouble::Noisy),
    with("half out of the picture", Trouble::HalfOut),
    with("holes in its depth", Trouble::HolesInDepth),
    with("no depth on it", Trouble::NoDepth),
    with("depth shifted", Trouble::ShiftedDepth),
    with("something touches it", Trouble::Touching),
    with("red things about it", Trouble::RedThings),
    Kind { ball: false, ..with("no ball", Trouble::None) },
    Kind { ball: false, ..with("no ball: coloured light", Trouble::ColouredLight) },
    Kind { ball: false, ..with("no ball: red things", Trouble::RedThings) },
];

/// Pictures of one kind.
pub(super) struct HardShots<'a> {
    kind: Kind,
    camera: Camera,
    recorded: &'a [RgbdFrame],
    random: ChaCha8Rng,
    shot: usize,
}

/// Where a ball is put.
#[derive(Clone, Copy)]
struct Place {
    u: f64,
    v: f64,
    z: f64,
    /// Pixels.
    radius: f64,
}

impl<'a> HardShots<'a> {
    /// Pictures of `kind`, number `number`, in the `recorded` ones.
    pub(super) fn new(
        (number, kind): (u64, Kind),
        camera: &Camera,
        recorded: &'a [RgbdFrame],
        options: &VisionOptions,
    ) -> Self {
        let seed = options.seed.wrapping_mul(1000).wrapping_add(500 + number);
        let camera = suite_camera(FrameSuite::Hard, camera);
        Self { kind, camera, recorded, random: ChaCha8Rng::seed_from_u64(seed), shot: 0 }
    }

    /// The next picture; `None` where there is none to put a ball into.
    pub(super) fn next(&mut self) -> Result<Option<Shot>, VisionError> {
        if self.recorded.is_empty() {
            return Ok(None);
        }
        let behind = &self.recorded[self.random.random_range(0..self.recorded.len())];
        let (light, mirrored) = (self.light(), self.random.random_bool(0.5));
        let mut overlay = Overlay::new(behind, &self.camera, &light, mirrored);
        let strange = self.kind.trouble == Trouble::ColouredLight;
        let cast = if strange { 0.6..1.5 } else { 0.85..1.15 };
        overlay.tint(std::array::from_fn(|_| self.random.random_range(cast.clone())));
        let things = match self.kind.trouble {
            Trouble::RedThings => self.random.random_range(3..7),
            _ => self.random.random_range(0..3),
        };
        for _ in 0..things {
            self.put_thing(&mut overlay)?;
        }
        let mut shot = Shot { ball: None, centre: Point3::origin(), frame: behind.clone() };
        if self.kind.ball {
            let place = self.place(&overlay);
            shot.centre =
                self.camera.pose * self.camera.intrinsics.deproject(place.u, place.v, place.z);
            shot.ball = Some([place.u, place.v, place.radius]);
            self.put_ball(&mut overlay, &place)?;
        }
        let exposure = self.exposure();
        shot.frame = overlay.finish(self.shot as f64 / 30.0, &exposure, &mut self.random)?;
        self.shot += 1;
        Ok(Some(shot))
    }

    fn light(&mut self) -> Light {
        let strange = self.kind.trouble == Trouble::ColouredLight;
        let mut colour = |strength: f64| {
            let spread = if strange { 0.4 } else { 0.12 };
            std::array::from_fn(|_| strength * self.random.random_range(1.0 - spread..1.0 + spread))
        };
        let (key, sky, ground) = (colour(0.7), colour(0.3), colour(0.15));
        let (sin, cos) = self.random.random_range(-1.3_f64..1.3).sin_cos();
        let direction = Vector3::new(cos, sin, self.random.random_range(0.1..1.2));
        Light { direction, key, sky, ground }
    }

    fn exposure(&mut self) -> Exposure {
        let random = &mut self.random;
        let gain = match self.kind.trouble {
            Trouble::Dim => random.random_range(0.06..0.3),
            Trouble::Bright => random.random_range(1.5..3.0),
            _ if !self.kind.ball => random.random_range(0.4..1.8),
            _ => 1.0,
        };
        let noise = match self.kind.trouble {
            Trouble::Noisy => random.random_range(6.0..20.0),
            _ => random.random_range(1.0..3.0),
        };
        let shift = match self.kind.trouble {
            Trouble::ShiftedDepth => (random.random_range(-3..=3), random.random_range(-2..=2)),
            _ => (0, 0),
        };
        Exposure { gain, noise, shift }
    }

    /// Before everything that it hides.
    fn place(&mut self, overlay: &Overlay) -> Place {
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
        let mut last = Place {
            u: lens.cx,
            v: lens.cy,
            z: DISTANCES.0,
            radius: lens.fx * DIAMETER / 2.0 / DISTANCES.0,
        };
        for attempt in 0..60 {
            let mut z = self.random.random_range(DISTANCES.0..DISTANCES.1);
            let radius = lens.fx * DIAMETER / 2.0 / z;
            let (u, v) = at(&mut self.random, radius, self.kind.trouble == Trouble::HalfOut);
            let free = overlay.nearest((u, v), 1.2 * radius) - DIAMETER / 2.0 - 0.01;
            if attempt > 25 {
                z = z.min(free).max(DISTANCES.0);
            }
            last = Place { u, v, z, radius: lens.fx * DIAMETER / 2.0 / z };
            if z <= free {
                return last;
            }
        }
        last
    }

    fn put_ball(&mut self, overlay: &mut Overlay, place: &Place) -> Result<(), VisionError> {
        let Place { u, v, z, radius } = *place;
        let holes = match self.kind.trouble {
            Trouble::HolesInDepth => self.random.random_range(0.3..0.7),
            Trouble::NoDepth => 1.0,
            _ => 0.03,
        };
        let mut look = Look {
            blur: self.random.random_range(0.4..0.8),
            motion: (0.0, 0.0),
            holes,
            linear: self.random.random_bool(0.5),
        };
        if self.kind.trouble == Trouble::Blurred {
            look.blur = self.random.random_range(1.2..(0.2 * radius + 1.3).min(4.0));
        }
        if self.kind.trouble == Trouble::Moving {
            let (sin, cos) = self.random.random_range(0.0..std::f64::consts::TAU).sin_cos();
            let way = radius * self.random.random_range(0.25..0.9);
            look.motion = (way * cos, way * sin);
        }
        // The cables that it hangs on.
        for _ in 0..self.random.random_range(0..4) {
            let to = (
                u + self.random.random_range(-300.0..300.0),
                v - self.random.random_range(200.0..500.0),
            );
            let (width, grey) =
                (self.random.random_range(0.5..1.6), self.random.random_range(0.02..0.8));
            overlay.line((u, v), to, width, grey);
        }
        let red = self.red();
        let material = Material {
            gloss: self.random.random_range(0.0..1.0),
            shininess: self.random.random_range(15.0..150.0),
            ..red
        };
        let centre = self.in_camera(u, v, z);
        if self.kind.trouble == Trouble::Touching {
            self.put_neighbour(overlay, place)?;
        }
        let shape = Shape::Sphere { centre, radius: DIAMETER / 2.0 };
        overlay.put(&Thing::new(shape, material), &look, &mut self.random)?;
        match self.kind.trouble {
            Trouble::Cable => self.put_cable(overlay, place, 0.08..0.2),
            Trouble::TwoCables => (0..2).for_each(|_| self.put_cable(overlay, place, 0.2..0.35)),
            Trouble::Post => self.put_post(overlay, place)?,
            _ => {}
        }
        Ok(())
    }

    /// A cable across the ball, its width within `widths` of the ball's radius.
    fn put_cable(&mut self, overlay: &mut Overlay, place: &Place, widths: std::ops::Range<f64>) {
        let (sin, cos) = self.random.random_range(0.0..std::f64::consts::PI).sin_cos();
        let off = place.radius * self.random.random_range(-0.5..0.5);
        let (u, v) = (place.u - sin * off, place.v + cos * off);
        let (width, grey) =
            (place.radius * self.random.random_range(widths) + 0.6, [0.01, 0.05, 0.3, 0.8]);
        let grey = grey[self.random.random_range(0..4)];
        overlay.line(
            (u - 900.0 * cos, v - 900.0 * sin),
            (u + 900.0 * cos, v + 900.0 * sin),
            width,
            grey,
        );
    }

    /// A post that hides an eighth to a half of it.
    fn put_post(&mut self, overlay: &mut Overlay, place: &Place) -> Result<(), VisionError> {
        let z = place.z - self.random.random_range(0.06..0.2);
        let hidden = self.random.random_range(0.12..0.5);
        let side = if self.random.random_bool(0.5) { 1.0 } else { -1.0 };
        let half = place.radius * self.random.random_range(0.3..1.5);
        let u = place.u + side * (place.radius * (1.0 - 2.0 * hidden) + half);
        let lens = self.camera.intrinsics;
        let half = half * z / lens.fx;
        let shape = Shape::Block {
            centre: self.in_camera(u, lens.cy, z + half),
            half: Vector3::new(half, half, 2.0),
            yaw: 0.0,
        };
        let colour =
            [[150, 150, 150], [60, 60, 60], [180, 140, 90], [230, 230, 230], [110, 45, 35]]
                [self.random.random_range(0..5)];
        self.put(overlay, Thing::new(shape, srgb(colour).matt()))
    }

    /// Something as near as the ball that touches it from beside or below.
    fn put_neighbour(&mut self, overlay: &mut Overlay, place: &Place) -> Result<(), VisionError> {
        let half = self.random.random_range(0.02..0.06);
        let way = (DIAMETER / 2.0 + half) * self.camera.intrinsics.fx / place.z;
        let (du, dv) = [(way, 0.0), (-way, 0.0), (0.0, way)][self.random.random_range(0..3)];
        let colour = [[228, 178, 148], [90, 60, 40], [235, 235, 230], [30, 30, 34], [60, 80, 160]]
            [self.random.random_range(0..5)];
        let shape = Shape::Block {
            centre: self.in_camera(place.u + du, place.v + dv, place.z),
            half: Vector3::repeat(half),
            yaw: 0.0,
        };
        self.put(overlay, Thing::new(shape, srgb(colour).matt()))
    }

    /// Something that is no ball, before what is there: red things, and balls of other sizes and
    /// colours.
    fn put_thing(&mut self, overlay: &mut Overlay) -> Result<(), VisionError> {
        let red = self.red();
        let kind = self.random.random_range(0..7);
        let size = match kind {
            2 => self.random.random_range(0.09..0.16),
            3 => DIAMETER / 2.0 * [0.45, 2.0, 2.6][self.random.random_range(0..3)],
            4 => DIAMETER / 2.0,
            5 => self.random.random_range(0.05..0.09),
            _ => self.random.random_range(0.03..0.09),
        };
        let lens = self.camera.intrinsics;
        let (width, height) = (2.0 * lens.cx + 1.0, 2.0 * lens.cy + 1.0);
        let mut within = |size: f64| self.random.random_range(0.05 * size..0.95 * size);
        let (u, v) = (within(width), within(height));
        let z = self.random.random_range(0.6..1.8_f64);
        let free = overlay.nearest((u, v), lens.fx * size / z) - size;
        let z = z.min(free);
        if z < 0.45 + size {
            return Ok(());
        }
        let centre = self.in_camera(u, v, z);
        let sphere = |material| Thing::new(Shape::Sphere { centre, radius: size }, material);
        let block = |half, yaw, material: Material| {
            Thing::new(Shape::Block { centre, half, yaw }, material.matt())
        };
        let yaw = self.random.random_range(0.0..1.5);
        let half = Vector3::new(
            size,
            self.random.random_range(0.4..1.0) * size,
            self.random.random_range(0.4..1.2) * size,
        );
        let thing = match kind {
            0 => {
                let shape = Shape::Cylinder {
                    base: centre - Vector3::z() * 0.058,
                    radius: 0.033,
                    height: 0.115,
                };
                Thing::new(shape, red).with_pattern(Pattern::Label([0.75; 3]))
            }
            1 => {
                let paper = [[235, 235, 230], [240, 200, 60], [60, 80, 160]]
                    [self.random.random_range(0..3)];
                block(half, yaw, srgb(paper)).with_pattern(Pattern::Print(red.colour))
            }
            2 => sphere(Material { colour: red.colour.map(|x| 0.6 * x), ..red }.matt()),
            3 => sphere(red),
            4 => sphere(srgb(
                [[240, 132, 30], [240, 240, 238], [228, 178, 148], [40, 60, 190]]
                    [self.random.random_range(0..4)],
            )),
            5 => sphere(
                srgb([[150, 85, 45], [120, 60, 30], [110, 45, 35]][self.random.random_range(0..3)])
                    .matt(),
            ),
            _ => block(half, yaw, red).with_pattern(Pattern::Wood),
        };
        self.put(overlay, thing)
    }

    fn put(&mut self, overlay: &mut Overlay, thing: Thing) -> Result<(), VisionError> {
        let look = Look { blur: 0.6, motion: (0.0, 0.0), holes: 0.01, linear: true };
        Ok(overlay.put(&thing, &look, &mut self.random)?)
    }

    /// A red, as balls and other red things have it.
    fn red(&mut self) -> Material {
        const REDS: [[u8; 3]; 7] = [
            [196, 32, 34],
            [180, 20, 30],
            [215, 45, 40],
            [150, 25, 30],
            [205, 30, 60],
            [225, 60, 45],
            [170, 15, 15],
        ];
        srgb(REDS[self.random.random_range(0..REDS.len())])
    }

    /// Where a pixel at depth `z` is in the rig frame.
    fn in_camera(&self, u: f64, v: f64, z: f64) -> Point3<f64> {
        self.camera.pose * self.camera.intrinsics.deproject(u, v, z)
    }
}

fn srgb([red, green, blue]: [u8; 3]) -> Material {
    Material::from_srgb(red, green, blue)
}
