//! The ball of a composited frame and the cables that hold it.

use nalgebra::{Rotation3, Unit, Vector3};
use plumb_sim::synthetic::compositor::{Appearance, Compositor};
use plumb_sim::synthetic::{Material, Object, Shape};
use rand::RngExt;

use super::{BallPlacement, DIAMETER, Placer};
use crate::vision::BoxedError;

impl Placer {
    /// Adds up to three cables that hold the ball.
    pub(in crate::vision) fn add_own_cables(
        &mut self,
        compositor: &mut Compositor,
        place: &BallPlacement,
    ) {
        let BallPlacement { u, v, .. } = *place;
        for _ in 0..self.random.random_range(0..4) {
            let to = (
                u + self.random.random_range(-300.0..300.0),
                v - self.random.random_range(200.0..500.0),
            );
            let (width, grey) =
                (self.random.random_range(0.5..1.6), self.random.random_range(0.02..0.8));
            compositor.line((u, v), to, width, grey);
        }
    }

    /// Adds a ball of `material` at `place`.
    pub(in crate::vision) fn add_sphere(
        &mut self,
        compositor: &mut Compositor,
        place: &BallPlacement,
        material: Material,
        appearance: &Appearance,
    ) -> Result<(), BoxedError> {
        let centre = self.deproject(place.u, place.v, place.z);
        let shape = Shape::Sphere { centre, radius: DIAMETER / 2.0 };
        Ok(compositor.add(&Object::new(shape, material), appearance, &mut self.random)?)
    }

    /// Adds a disc at `place`, its normal `slant` degrees off the line of sight in any direction.
    pub(in crate::vision) fn add_disc(
        &mut self,
        compositor: &mut Compositor,
        place: &BallPlacement,
        (slant, material): (f64, Material),
        appearance: &Appearance,
    ) -> Result<(), BoxedError> {
        let (radius, camera) = (DIAMETER / 2.0, &self.camera);
        let seen = camera.intrinsics.deproject(place.u, place.v, place.z);
        let ray = Unit::new_normalize(seen.coords);
        let aside = Vector3::y().cross(&ray).normalize();
        let turn = self.random.random_range(0.0..std::f64::consts::TAU);
        let axis = Rotation3::from_axis_angle(&ray, turn) * Unit::new_normalize(aside);
        let tilt = Rotation3::from_axis_angle(&axis, slant.to_radians());
        let centre = camera.pose * seen;
        let normal = camera.pose * (tilt * -ray.into_inner());
        let shape = Shape::Disc { centre, radius, normal };
        compositor.add(&Object::new(shape, material), appearance, &mut self.random)?;
        Ok(())
    }

    /// Returns a random red material, matt to glossy.
    pub(in crate::vision) fn ball_material(&mut self) -> Material {
        let red = self.red();
        Material {
            gloss: self.random.random_range(0.0..1.0),
            shininess: self.random.random_range(15.0..150.0),
            ..red
        }
    }
}
