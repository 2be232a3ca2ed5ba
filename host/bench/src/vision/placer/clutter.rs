//! Objects in a composited frame besides the ball: occluders and neighbours.

use nalgebra::Vector3;
use plumb_sim::synthetic::compositor::{Appearance, Compositor};
use plumb_sim::synthetic::{Material, Object, Shape};
use rand::RngExt;

use super::{BallPlacement, DIAMETER, Placer};
use crate::vision::BoxedError;

impl Placer {
    /// Adds a cable across the ball, with a width in the range `widths` of the ball's radius.
    pub(in crate::vision) fn add_cable(
        &mut self,
        compositor: &mut Compositor,
        place: &BallPlacement,
        widths: std::ops::Range<f64>,
    ) {
        let (sin, cos) = self.random.random_range(0.0..std::f64::consts::PI).sin_cos();
        let off = place.radius * self.random.random_range(-0.5..0.5);
        let (u, v) = (place.u - sin * off, place.v + cos * off);
        let (width, grey) =
            (place.radius * self.random.random_range(widths) + 0.6, [0.01, 0.05, 0.3, 0.8]);
        let grey = grey[self.random.random_range(0..4)];
        compositor.line(
            (u - 900.0 * cos, v - 900.0 * sin),
            (u + 900.0 * cos, v + 900.0 * sin),
            width,
            grey,
        );
    }

    /// Adds a post that occludes an eighth to a half of the ball.
    pub(in crate::vision) fn add_post(
        &mut self,
        compositor: &mut Compositor,
        place: &BallPlacement,
    ) -> Result<(), BoxedError> {
        let z = place.z - self.random.random_range(0.06..0.2);
        let hidden = self.random.random_range(0.12..0.5);
        let side = if self.random.random_bool(0.5) { 1.0 } else { -1.0 };
        let half = place.radius * self.random.random_range(0.3..1.5);
        let u = place.u + side * (place.radius * (1.0 - 2.0 * hidden) + half);
        let lens = self.camera.intrinsics;
        let half = half * z / lens.fx;
        let shape = Shape::Block {
            centre: self.deproject(u, lens.cy, z + half),
            half: Vector3::new(half, half, 2.0),
            yaw: 0.0,
        };
        let colour =
            [[150, 150, 150], [60, 60, 60], [180, 140, 90], [230, 230, 230], [110, 45, 35]]
                [self.random.random_range(0..5)];
        self.add(compositor, Object::new(shape, srgb(colour).matt()))
    }

    /// Adds a block at the ball's distance that touches the ball from beside or below.
    pub(in crate::vision) fn add_neighbour(
        &mut self,
        compositor: &mut Compositor,
        place: &BallPlacement,
    ) -> Result<(), BoxedError> {
        let half = self.random.random_range(0.02..0.06);
        let way = (DIAMETER / 2.0 + half) * self.camera.intrinsics.fx / place.z;
        let (du, dv) = [(way, 0.0), (-way, 0.0), (0.0, way)][self.random.random_range(0..3)];
        let colour = [[228, 178, 148], [90, 60, 40], [235, 235, 230], [30, 30, 34], [60, 80, 160]]
            [self.random.random_range(0..5)];
        let shape = Shape::Block {
            centre: self.deproject(place.u + du, place.v + dv, place.z),
            half: Vector3::repeat(half),
            yaw: 0.0,
        };
        self.add(compositor, Object::new(shape, srgb(colour).matt()))
    }

    /// Adds an object in sharp focus.
    pub(in crate::vision) fn add(
        &mut self,
        compositor: &mut Compositor,
        thing: Object,
    ) -> Result<(), BoxedError> {
        let appearance =
            Appearance { blur: 0.6, motion: (0.0, 0.0), rolling: 0.0, holes: 0.01, linear: true };
        Ok(compositor.add(&thing, &appearance, &mut self.random)?)
    }

    /// Returns a red of balls and other red objects.
    pub(in crate::vision) fn red(&mut self) -> Material {
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
}

/// Returns the material of an sRGB colour: red, green, blue.
pub(super) fn srgb([red, green, blue]: [u8; 3]) -> Material {
    Material::from_srgb(red, green, blue)
}
