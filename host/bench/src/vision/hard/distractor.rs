//! Distractors in a hard frame: red objects, and balls of another size or colour.

use nalgebra::{Point3, Vector3};
use plumb_sim::synthetic::compositor::Compositor;
use plumb_sim::synthetic::{Material, Object, Pattern, Shape};
use rand::RngExt;

use super::clutter::srgb;
use super::{DIAMETER, HardFrames};
use crate::vision::VisionError;

/// Kind of distractor.
#[derive(Debug, Clone, Copy)]
enum Distractor {
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
}

impl Distractor {
    /// Every kind.
    const ALL: [Self; 7] = [
        Self::Can,
        Self::Printed,
        Self::LargeDarkBall,
        Self::OtherSize,
        Self::OtherColour,
        Self::BrownBall,
        Self::Wood,
    ];
}

/// Colours of boxes, sRGB.
const PAPERS: [[u8; 3]; 3] = [[235, 235, 230], [240, 200, 60], [60, 80, 160]];
/// Colours of balls that are not red, sRGB.
const OTHER_COLOURS: [[u8; 3]; 4] =
    [[240, 132, 30], [240, 240, 238], [228, 178, 148], [40, 60, 190]];
/// Colours of brown balls, sRGB.
const BROWNS: [[u8; 3]; 3] = [[150, 85, 45], [120, 60, 30], [110, 45, 35]];

impl HardFrames<'_> {
    /// Adds a distractor in front of everything it covers. Adds nothing if there is no room at the
    /// drawn position.
    pub(super) fn add_distractor(
        &mut self,
        compositor: &mut Compositor,
    ) -> Result<(), VisionError> {
        let red = self.red();
        let kind = Distractor::ALL[self.random.random_range(0..Distractor::ALL.len())];
        let size = self.distractor_size(kind);
        let Some(centre) = self.distractor_centre(compositor, size) else { return Ok(()) };
        let object = self.distractor(kind, centre, size, red);
        self.add(compositor, object)
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

    /// Returns a distractor with random details.
    fn distractor(
        &mut self,
        kind: Distractor,
        centre: Point3<f64>,
        size: f64,
        red: Material,
    ) -> Object {
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
        match kind {
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
        }
    }
}
