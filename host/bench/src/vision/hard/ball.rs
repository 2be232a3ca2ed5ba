//! The ball of a hard frame, its cables and its occluders.

use plumb_sim::synthetic::compositor::{Appearance, Compositor};
use rand::RngExt;

use super::{Condition, HardFrames};
use crate::vision::BoxedError;
use crate::vision::placer::BallPlacement;

impl HardFrames<'_> {
    /// Adds the ball at `place`, with its cables and the objects of the frame's condition.
    pub(super) fn add_ball(
        &mut self,
        compositor: &mut Compositor,
        place: &BallPlacement,
    ) -> Result<(), BoxedError> {
        let appearance = self.ball_appearance(place.radius);
        let placer = &mut self.placer;
        placer.add_own_cables(compositor, place);
        let material = placer.ball_material();
        if self.case.condition == Condition::Touching {
            placer.add_neighbour(compositor, place)?;
        }
        placer.add_sphere(compositor, place, material, &appearance)?;
        match self.case.condition {
            Condition::Cable => placer.add_cable(compositor, place, 0.08..0.2),
            Condition::TwoCables => {
                (0..2).for_each(|_| placer.add_cable(compositor, place, 0.2..0.35))
            }
            Condition::Post => placer.add_post(compositor, place)?,
            _ => {}
        }
        Ok(())
    }

    /// Returns a random focus, motion blur and share of missing depth of a ball with this `radius`,
    /// pixels.
    fn ball_appearance(&mut self, radius: f64) -> Appearance {
        let holes = match self.case.condition {
            Condition::HolesInDepth => self.placer.random.random_range(0.3..0.7),
            Condition::NoDepth => 1.0,
            _ => 0.03,
        };
        let mut appearance = Appearance {
            blur: self.placer.random.random_range(0.4..0.8),
            motion: (0.0, 0.0),
            rolling: 0.0,
            holes,
            linear: self.placer.random.random_bool(0.5),
        };
        if self.case.condition == Condition::Blurred {
            appearance.blur = self.placer.random.random_range(1.2..(0.2 * radius + 1.3).min(4.0));
        }
        if self.case.condition == Condition::Moving {
            let (sin, cos) = self.placer.random.random_range(0.0..std::f64::consts::TAU).sin_cos();
            let way = radius * self.placer.random.random_range(0.25..0.9);
            appearance.motion = (way * cos, way * sin);
        }
        appearance
    }
}
