//! Error of the camera's pose in a suite: measured positions against true ones.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use plumb_emulator::plant::Task;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::BenchError;
use crate::calibration::{CalibrationWay, Trial, trial};
use crate::run_id::RunId;

/// Stream of the random numbers that give the axis.
const AXIS_STREAM: u64 = 1 << 42;

/// Error of the camera's pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrameError {
    /// The true pose.
    None,
    /// Positions are turned about the target, by this angle (radians) about a random axis: the
    /// target's own position is right.
    Turned(f64),
    /// The pose is found by a calibration.
    Calibrated(CalibrationWay),
}

/// Map from true to measured positions.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Frame {
    /// No error.
    True,
    /// Rotation about a point.
    Turned {
        /// Rotation.
        rotation: UnitQuaternion<f64>,
        /// Point that stays, metres.
        about: Point3<f64>,
    },
    /// The pose of a calibration.
    Calibrated(Box<Trial>),
}

impl FrameError {
    /// Returns the map of a run.
    ///
    /// # Errors
    /// If the calibrations of the rig's camera fail too often.
    pub(crate) fn frame(self, task: &Task, id: RunId) -> Result<Frame, BenchError> {
        match self {
            Self::None => Ok(Frame::True),
            Self::Turned(angle) => {
                let mut random = ChaCha8Rng::seed_from_u64(id.seed);
                random.set_stream(AXIS_STREAM | id.rig);
                let axis = Vector3::from_fn(|_, _| StandardNormal.sample(&mut random));
                let axis: Vector3<f64> = axis;
                let rotation = UnitQuaternion::from_scaled_axis(axis.normalize() * angle);
                Ok(Frame::Turned { rotation, about: task.target })
            }
            Self::Calibrated(way) => {
                let trial = trial(way, task, id);
                let trial = trial.map_err(|error| BenchError::Calibration { id, error })?;
                Ok(Frame::Calibrated(Box::new(trial)))
            }
        }
    }
}

impl Frame {
    /// Returns the measured position of a true one, metres.
    pub(crate) fn measured(&self, p: Point3<f64>) -> Point3<f64> {
        match self {
            Self::True => p,
            Self::Turned { rotation, about } => about + rotation * (p - about),
            Self::Calibrated(trial) => trial.measured(&p),
        }
    }

    /// Returns the true position of a measured one, metres.
    pub(crate) fn true_position(&self, p: Point3<f64>) -> Point3<f64> {
        match self {
            Self::True => p,
            Self::Turned { rotation, about } => about + rotation.inverse() * (p - about),
            Self::Calibrated(trial) => trial.true_position(&p),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_calibrated_frame_is_inverted() {
        let task = Task::paper();
        let error = FrameError::Calibrated(CalibrationWay::Ball);
        let frame = error.frame(&task, RunId { seed: 1, rig: 3 }).unwrap();
        let measured = frame.measured(task.target);
        assert!((1e-4..0.02).contains(&(measured - task.target).norm()), "{measured}");
        assert!((frame.true_position(measured) - task.target).norm() < 1e-9);
    }

    #[test]
    fn a_turned_frame_keeps_the_target_and_all_distances_to_it() {
        let task = Task::paper();
        let frame = FrameError::Turned(0.2).frame(&task, RunId { seed: 1, rig: 3 }).unwrap();
        assert!((frame.measured(task.target) - task.target).norm() < 1e-12);
        let (from, to) = (task.start - task.target, frame.measured(task.start) - task.target);
        assert!((from.norm() - to.norm()).abs() < 1e-12);
        assert!(from.angle(&to) <= 0.2 + 1e-12 && from != to);
        let back = frame.true_position(frame.measured(task.start));
        assert!((back - task.start).norm() < 1e-12);
        let again = FrameError::Turned(0.2).frame(&task, RunId { seed: 1, rig: 3 }).unwrap();
        assert_eq!(frame, again);
    }
}
