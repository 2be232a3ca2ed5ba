//! Distractors in a composited frame: red objects, and balls of another size or colour.

use nalgebra::{Point3, Vector3};
use plumb_sim::synthetic::compositor::Compositor;
use plumb_sim::synthetic::{Material, Object, Pattern, Shape};
use rand::RngExt;

use super::clutter::srgb;
use super::{DIAMETER, Placer};
use crate::vision::BoxedError;

/// Kind of distractor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::vision) enum Distractor {
    /// A red can with a label.
    Can,
    /// A box with a red print.
    Printed,
    /// A large ball of a dark matt red.
    LargeDarkBall,
    /// A red ball of another size.
    OtherSize,
    /// A ball of the right size in another colour.
    OtherColour,
    /// A large matt brown ball.
    BrownBall,
    /// A red block with the grain of wood.
    Wood,
    /// A red cushion.
    Cushion,
    /// A red flower: petals around a yellow middle.
    Flower,
    /// A red apple with yellow patches, larger than the ball.
    Apple,
    /// A red cupboard with doors.
    Cupboard,
    /// A red lampshade that glows.
    Lampshade,
}

impl Distractor {
    /// The kinds of the suite `hard`.
    pub(in crate::vision) const SOLID: [Self; 7] = [
        Self::Can,
        Self::Printed,
        Self::LargeDarkBall,
        Self::OtherSize,
        Self::OtherColour,
        Self::BrownBall,
        Self::Wood,
    ];
    /// Balls of another size or colour.
    pub(in crate::vision) const BALLS: [Self; 4] =
        [Self::LargeDarkBall, Self::OtherSize, Self::OtherColour, Self::BrownBall];
    /// Red objects that are no balls. Without depth a red ball of another size looks like the
    /// ball, so that these are the only distractors there.
    pub(in crate::vision) const RED_THINGS: [Self; 8] = [
        Self::Can,
        Self::Printed,
        Self::Wood,
        Self::Cushion,
        Self::Flower,
        Self::Apple,
        Self::Cupboard,
        Self::Lampshade,
    ];
}

/// Colours of boxes, sRGB.
const PAPERS: [[u8; 3]; 3] = [[235, 235, 230], [240, 200, 60], [60, 80, 160]];
/// Patches of an apple, linear, order blue, green, red.
const BLUSH: [f64; 3] = [0.05, 0.45, 0.6];
/// Colours of balls that are not red, sRGB.
const OTHER_COLOURS: [[u8; 3]; 4] =
    [[240, 132, 30], [240, 240, 238], [228, 178, 148], [40, 60, 190]];
/// Colours of brown balls, sRGB.
const BROWNS: [[u8; 3]; 3] = [[150, 85, 45], [120, 60, 30], [110, 45, 35]];

impl Placer {
    /// Adds one of the `kinds` of distractor in front of everything it covers. Returns whether
    /// there was room for it at the drawn position.
    pub(in crate::vision) fn add_distractor(
        &mut self,
        compositor: &mut Compositor,
        kinds: &[Distractor],
    ) -> Result<bool, BoxedError> {
        let red = self.red();
        let kind = kinds[self.random.random_range(0..kinds.len())];
        let size = self.distractor_size(kind);
        let Some(centre) = self.distractor_centre(compositor, size) else { return Ok(false) };
        for object in self.distractor(kind, centre, size, red) {
            self.add(compositor, object)?;
        }
        Ok(true)
    }

    /// Returns a random radius or half width, metres.
    fn distractor_size(&mut self, kind: Distractor) -> f64 {
        match kind {
            Distractor::LargeDarkBall => self.random.random_range(0.09..0.16),
            Distractor::OtherSize => {
                DIAMETER / 2.0 * [0.45, 2.0, 2.6][self.random.random_range(0..3)]
            }
            Distractor::OtherColour => DIAMETER / 2.0,
            Distractor::BrownBall => self.random.random_range(0.05..0.09),
            Distractor::Can | Distractor::Printed | Distractor::Wood => {
                self.random.random_range(0.03..0.09)
            }
            Distractor::Cushion => self.random.random_range(0.12..0.2),
            Distractor::Flower => self.random.random_range(0.025..0.05),
            Distractor::Apple => DIAMETER / 2.0 * self.random.random_range(1.2..1.5),
            Distractor::Cupboard => self.random.random_range(0.2..0.4),
            Distractor::Lampshade => self.random.random_range(0.06..0.12),
        }
    }

    /// Returns a random centre (rig frame, metres) in front of the frame's content; `None` if that
    /// is too near to the camera.
    fn distractor_centre(&mut self, compositor: &Compositor, size: f64) -> Option<Point3<f64>> {
        let lens = self.camera.intrinsics;
        let (width, height) = (2.0 * lens.cx + 1.0, 2.0 * lens.cy + 1.0);
        let mut within = |size: f64| self.random.random_range(0.05 * size..0.95 * size);
        let (u, v) = (within(width), within(height));
        let z = self.random.random_range(0.6..1.8_f64);
        let free = compositor.nearest((u, v), lens.fx * size / z) - size;
        let z = z.min(free);
        (z >= 0.45 + size).then(|| self.deproject(u, v, z))
    }

    /// Returns the parts of a distractor with random details.
    fn distractor(
        &mut self,
        kind: Distractor,
        centre: Point3<f64>,
        size: f64,
        red: Material,
    ) -> Vec<Object> {
        let yaw = self.random.random_range(0.0..1.5);
        let half = Vector3::new(
            size,
            self.random.random_range(0.4..1.0) * size,
            self.random.random_range(0.4..1.2) * size,
        );
        let mut colour =
            |colours: &[[u8; 3]]| srgb(colours[self.random.random_range(0..colours.len())]);
        let sphere = |material| Object::new(Shape::Sphere { centre, radius: size }, material);
        let block =
            |material: Material| Object::new(Shape::Block { centre, half, yaw }, material.matt());
        let ellipsoid = |half| Shape::Ellipsoid { centre, half, yaw };
        let object = match kind {
            Distractor::Can => {
                let base = centre - Vector3::z() * 0.058;
                let shape = Shape::Cylinder { base, radius: 0.033, height: 0.115 };
                Object::new(shape, red).with_pattern(Pattern::Label([0.75; 3]))
            }
            Distractor::Printed => block(colour(&PAPERS)).with_pattern(Pattern::Print(red.colour)),
            Distractor::LargeDarkBall => {
                sphere(Material { colour: red.colour.map(|x| 0.6 * x), ..red }.matt())
            }
            Distractor::OtherSize => sphere(red),
            Distractor::OtherColour => sphere(colour(&OTHER_COLOURS)),
            Distractor::BrownBall => sphere(colour(&BROWNS).matt()),
            Distractor::Wood => block(red).with_pattern(Pattern::Wood),
            Distractor::Cushion => {
                let half = Vector3::new(0.4 * size, size, 0.8 * size);
                Object::new(ellipsoid(half), red.matt()).with_pattern(Pattern::Cloth)
            }
            Distractor::Flower => return flower(centre, size, red),
            Distractor::Apple => {
                let half = Vector3::new(size, size, 0.86 * size);
                Object::new(ellipsoid(half), red).with_pattern(Pattern::Blush(BLUSH))
            }
            Distractor::Cupboard => block(red).with_pattern(Pattern::Doors),
            Distractor::Lampshade => {
                let base = centre - Vector3::z() * size;
                let shape = Shape::Cylinder { base, radius: 0.8 * size, height: 1.6 * size };
                Object::new(shape, red).glowing(1.2)
            }
        };
        vec![object]
    }
}

/// Returns a flower of `size` (radius, metres): petals around a yellow middle.
fn flower(centre: Point3<f64>, size: f64, red: Material) -> Vec<Object> {
    const PETALS: usize = 6;
    let petal = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / PETALS as f64).sin_cos();
        let centre = centre + Vector3::new(0.0, 0.6 * size * cos, 0.6 * size * sin);
        let half = Vector3::new(0.15 * size, 0.4 * size, 0.4 * size);
        Object::new(Shape::Ellipsoid { centre, half, yaw: 0.3 * cos }, red.matt())
    };
    let middle = Shape::Sphere { centre: centre + Vector3::x() * 0.1 * size, radius: 0.25 * size };
    let middle = Object::new(middle, srgb([230, 190, 40]).matt());
    (0..PETALS).map(petal).chain([middle]).collect()
}
