//! A target that moves in the world: where it is going, by where it was.

use nalgebra::{Point3, Rotation3, Vector3};

use crate::trajectory::Moment;

/// Least time between two observations that a turn is computed from, seconds: over a shorter one
/// the noise of the velocities would be a turn.
const SHORTEST_GAP_S: f64 = 0.025;

/// Longest time between two observations that a turn is computed from, seconds.
const LONGEST_GAP_S: f64 = 0.3;

/// Greatest turn between two observations that counts as a curve, radians. A sharper one is a
/// corner, after which the target goes straight on.
const GREATEST_TURN: f64 = 0.8;

/// Speed below which a direction means nothing, m/s.
const LEAST_SPEED: f64 = 1e-4;

/// Observation of the target.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Observation {
    /// Seconds.
    time: f64,
    position: Point3<f64>,
    velocity: Vector3<f64>,
}

/// A moving target. Between observations it is taken to go on at its speed and on its arc.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MovingTarget {
    last: Option<Observation>,
    /// Observation that the turn was last computed with.
    anchor: Option<Observation>,
    /// Turn of the velocity, radians a second, as a vector along its axis.
    turn: Vector3<f64>,
}

impl MovingTarget {
    /// Takes in that the target was at `position` (metres) with `velocity` (m/s) at `time`
    /// (seconds). An observation from before the last one is ignored.
    pub fn observe(&mut self, time: f64, position: Point3<f64>, velocity: Vector3<f64>) {
        let next = Observation { time, position, velocity };
        if self.last.is_some_and(|last| time < last.time) {
            return;
        }
        match &self.anchor {
            Some(anchor) if time - anchor.time < SHORTEST_GAP_S => {}
            Some(anchor) => (self.turn, self.anchor) = (turn(anchor, &next), Some(next)),
            None => self.anchor = Some(next),
        }
        self.last = Some(next);
    }

    /// Returns the time of the last observation, seconds.
    #[must_use]
    pub fn observed(&self) -> Option<f64> {
        self.last.map(|last| last.time)
    }

    /// Returns the target's motion at `time` (seconds); `None` before the first observation.
    #[must_use]
    pub fn at(&self, time: f64) -> Option<Moment> {
        let Observation { time: then, position, velocity } = self.last?;
        let elapsed = time - then;
        let (rate, turned) = (self.turn.norm(), Rotation3::new(self.turn * elapsed) * velocity);
        let moved = if rate * elapsed.abs() < 1e-6 {
            velocity * elapsed
        } else {
            // The chord of the arc: the integral of the turning velocity.
            let axis = self.turn / rate;
            let angle = rate * elapsed;
            let along = axis * axis.dot(&velocity);
            let across = velocity - along;
            along * elapsed
                + (across * angle.sin() + axis.cross(&across) * (1.0 - angle.cos())) / rate
        };
        Some(Moment {
            position: position + moved,
            velocity: turned,
            acceleration: self.turn.cross(&turned),
        })
    }
}

/// Returns the turn from one observation to the next, radians a second.
fn turn(from: &Observation, to: &Observation) -> Vector3<f64> {
    let gap = to.time - from.time;
    let slowest = from.velocity.norm().min(to.velocity.norm());
    if gap > LONGEST_GAP_S || slowest < LEAST_SPEED {
        return Vector3::zeros();
    }
    let angle = from.velocity.angle(&to.velocity);
    if angle > GREATEST_TURN {
        return Vector3::zeros();
    }
    let axis = from.velocity.cross(&to.velocity);
    axis.try_normalize(1e-12).map_or_else(Vector3::zeros, |axis| axis * (angle / gap))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS: f64 = 0.1;

    /// Returns the motion on a circle at 1 rad/s.
    fn circle(time: f64) -> (Point3<f64>, Vector3<f64>) {
        let (sin, cos) = time.sin_cos();
        (Point3::new(cos, sin, 3.0) * RADIUS, Vector3::new(-sin, cos, 0.0) * RADIUS)
    }

    #[test]
    fn a_target_on_a_circle_is_foretold_on_the_circle() {
        let mut target = MovingTarget::default();
        assert_eq!(target.at(0.0), None);
        for time in [0.0, 0.033, 0.066, 0.1] {
            let (position, velocity) = circle(time);
            target.observe(time, position, velocity);
        }
        for time in [0.1, 0.2, 0.5, 0.9] {
            let (position, velocity) = circle(time);
            let moment = target.at(time).unwrap();
            assert!((moment.position - position).norm() < 1e-9, "{time}");
            assert!((moment.velocity - velocity).norm() < 1e-9, "{time}");
            let inwards = Point3::new(0.0, 0.0, 3.0 * RADIUS) - position;
            assert!((moment.acceleration - inwards).norm() < 1e-9, "{time}");
        }
    }

    #[test]
    fn the_noise_of_velocities_that_come_often_is_no_turn() {
        let mut target = MovingTarget::default();
        for k in 0..200_u32 {
            // 5 mm/s of noise across 50 mm/s, in turn to either side.
            let noise = if k.is_multiple_of(2) { 0.0025 } else { -0.0025 };
            let time = 0.005 * f64::from(k);
            let position = Point3::new(0.05 * time, 0.0, 0.0);
            target.observe(time, position, Vector3::new(0.05, noise, 0.0));
        }
        let moment = target.at(0.995 + 0.3).unwrap();
        // A turn of 0.1 rad in 5 ms would be one of 6 rad in 0.3 s.
        assert!((moment.position - Point3::new(0.06475, 0.0, 0.0)).norm() < 0.01, "{moment:?}");
    }

    #[test]
    fn a_corner_a_gap_and_an_old_observation_are_no_turns() {
        let (x, y) = (Vector3::x(), Vector3::y());
        let origin = Point3::origin();
        for (time, velocity) in [(0.03, y), (0.4, x + 0.1 * y), (0.03, Vector3::zeros())] {
            let mut target = MovingTarget::default();
            target.observe(0.0, origin, x);
            target.observe(time, origin, velocity);
            target.observe(0.0, origin, -x);
            let moment = target.at(time + 1.0).unwrap();
            assert!((moment.position - origin - velocity).norm() < 1e-12);
            assert_eq!(moment.velocity, velocity);
        }
    }
}
