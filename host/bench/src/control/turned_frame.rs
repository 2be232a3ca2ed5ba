//! Error of the camera's pose in a suite: measured positions against true ones.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use plumb_emulator::plant::Task;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::run_id::RunId;

/// Stream of the random numbers that give the axis.
const AXIS_STREAM: u64 = 1 << 42;

/// Map from true to measured positions: a rotation about the target, so that the target's own
/// position is right.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TurnedFrame {
    rotation: UnitQuaternion<f64>,
    /// Point that stays, metres.
    about: Point3<f64>,
}

impl TurnedFrame {
    /// Returns the map of a run, by this angle (radians) about a random axis.
    pub(crate) fn new(angle: f64, task: &Task, id: RunId) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(id.seed);
        random.set_stream(AXIS_STREAM | id.rig);
        let axis = Vector3::from_fn(|_, _| StandardNormal.sample(&mut random));
        let axis: Vector3<f64> = axis;
        let rotation = UnitQuaternion::from_scaled_axis(axis.normalize() * angle);
        Self { rotation, about: task.target }
    }

    /// Returns the measured position of a true one, metres.
    pub(crate) fn measured(&self, p: Point3<f64>) -> Point3<f64> {
        self.about + self.rotation * (p - self.about)
    }

    /// Returns the true position of a measured one, metres.
    pub(crate) fn true_position(&self, p: Point3<f64>) -> Point3<f64> {
        self.about + self.rotation.inverse() * (p - self.about)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_frame_keeps_the_target_and_all_distances_to_it() {
        let task = Task::paper();
        let frame = TurnedFrame::new(0.2, &task, RunId { seed: 1, rig: 3 });
        assert!((frame.measured(task.target) - task.target).norm() < 1e-12);
        let (from, to) = (task.start - task.target, frame.measured(task.start) - task.target);
        assert!((from.norm() - to.norm()).abs() < 1e-12);
        assert!(from.angle(&to) <= 0.2 + 1e-12 && from != to);
        let back = frame.true_position(frame.measured(task.start));
        assert!((back - task.start).norm() < 1e-12);
        assert_eq!(frame, TurnedFrame::new(0.2, &task, RunId { seed: 1, rig: 3 }));
    }
}
