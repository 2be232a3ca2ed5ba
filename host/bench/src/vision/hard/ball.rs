//! The ball of a hard frame, its cables and its occluders.

use plumb_sim::synthetic::compositor::{Appearance, Compositor};
use plumb_sim::synthetic::{Material, Object, Shape};
use rand::RngExt;

use super::{BallPlacement, Condition, DIAMETER, HardFrames};
use crate::vision::VisionError;

impl HardFrames<'_> {
    /// Adds the ball at `place`, with its cables and the objects of the frame's condition.
    pub(super) fn add_ball(
        &mut self,
        compositor: &mut Compositor,
        place: &BallPlacement,
    ) -> Result<(), VisionError> {
        let appearance = self.ball_appearance(place.radius);
        self.add_own_cables(compositor, place);
        let material = self.ball_material();
        if self.case.condition == Condition::Touching {
            self.add_neighbour(compositor, place)?;
        }
        let centre = self.deproject(place.u, place.v, place.z);
        let shape = Shape::Sphere { centre, radius: DIAMETER / 2.0 };
        compositor.add(&Object::new(shape, material), &appearance, &mut self.random)?;
        match self.case.condition {
            Condition::Cable => self.add_cable(compositor, place, 0.08..0.2),
            Condition::TwoCables => {
                (0..2).for_each(|_| self.add_cable(compositor, place, 0.2..0.35))
            }
            Condition::Post => self.add_post(compositor, place)?,
            _ => {}
        }
        Ok(())
    }

    /// Returns a random focus, motion blur and share of missing depth of a ball with this `radius`,
    /// pixels.
    fn ball_appearance(&mut self, radius: f64) -> Appearance {
        let holes = match self.case.condition {
            Condition::HolesInDepth => self.random.random_range(0.3..0.7),
            Condition::NoDepth => 1.0,
            _ => 0.03,
        };
        let mut appearance = Appearance {
            blur: self.random.random_range(0.4..0.8),
            motion: (0.0, 0.0),
            holes,
            linear: self.random.random_bool(0.5),
        };
        if self.case.condition == Condition::Blurred {
            appearance.blur = self.random.random_range(1.2..(0.2 * radius + 1.3).min(4.0));
        }
        if self.case.condition == Condition::Moving {
            let (sin, cos) = self.random.random_range(0.0..std::f64::consts::TAU).sin_cos();
            let way = radius * self.random.random_range(0.25..0.9);
            appearance.motion = (way * cos, way * sin);
        }
        appearance
    }

    /// Adds up to three cables that hold the ball.
    fn add_own_cables(&mut self, compositor: &mut Compositor, place: &BallPlacement) {
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

    /// Returns a random red material, matt to glossy.
    fn ball_material(&mut self) -> Material {
        let red = self.red();
        Material {
            gloss: self.random.random_range(0.0..1.0),
            shininess: self.random.random_range(15.0..150.0),
            ..red
        }
    }
}
