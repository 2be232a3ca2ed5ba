//! Table `[simulation]` of a rig file.

use nalgebra::{Isometry3, Point3};
use plumb_cameras::camera_file::Pose;
use plumb_config::quantity::Coordinate;
use serde::Deserialize;

use super::quantity::PulleyRadius;
use super::wiring::Wiring;

/// A simulated rig.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Simulation {
    /// Motor points A, B, C, metres in the rig frame.
    pub motors: [[Coordinate; 3]; 3],
    /// Pulley radii, metres.
    pub pulley_radii: [PulleyRadius; 3],
    /// First position of the ball, metres in the rig frame.
    pub start: [Coordinate; 3],
    /// Motors on the outputs of the board.
    #[serde(default)]
    pub wiring: Wiring,
    /// Whether the simulated motors A, B, C turn the wrong way round.
    #[serde(default)]
    pub reversed: [bool; 3],
    /// True pose of the simulated camera; that of the camera file where absent.
    pub camera: Option<Pose>,
}

impl Simulation {
    /// Returns the motor points A, B, C, metres in the rig frame.
    pub fn motors(&self) -> [Point3<f64>; 3] {
        self.motors.map(|motor| Point3::from(motor.map(Coordinate::get)))
    }

    /// Returns the true pose of the simulated camera, where its camera file says `pose`.
    pub fn camera_pose(&self, pose: Isometry3<f64>) -> Isometry3<f64> {
        self.camera.as_ref().map_or(pose, Pose::isometry)
    }

    /// Returns the ball's first position, metres in the rig frame.
    pub fn start(&self) -> Point3<f64> {
        Point3::from(self.start.map(Coordinate::get))
    }
}
