//! Table `[simulation]` of a rig file: the simulated rig with its wiring; and the motor points for
//! the outputs that draw a rig.

use nalgebra::{Isometry3, Point3};
use plumb_cameras::camera_file::Pose;
use plumb_config::quantity::Coordinate;
use plumb_protocol::MotorList;
use serde::Deserialize;
use thiserror::Error;

use super::quantity::{FULL_STEPS_PER_REVOLUTION, PulleyRadius};

/// A simulated rig.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Simulation {
    /// Point of each motor, metres in the rig frame.
    pub motors: MotorList<[Coordinate; 3]>,
    /// Radius of each pulley, metres.
    pub pulley_radii: MotorList<PulleyRadius>,
    /// First position of the ball, metres in the rig frame.
    pub start: [Coordinate; 3],
    /// Motors on the outputs of the board.
    #[serde(default)]
    pub wiring: Wiring,
    /// Whether each simulated motor turns the wrong way round; by default none.
    pub reversed: Option<MotorList<bool>>,
    /// True pose of the simulated camera; that of the camera file where absent.
    pub camera: Option<Pose>,
}

impl Simulation {
    /// Returns the motor points, metres in the rig frame.
    pub fn motors(&self) -> MotorList<Point3<f64>> {
        self.motors.map(|motor| Point3::from(motor.map(Coordinate::get)))
    }

    /// Returns the true pose of the simulated camera, where its camera file says `pose`.
    pub fn camera_pose(&self, pose: Isometry3<f64>) -> Isometry3<f64> {
        self.camera.as_ref().map_or(pose, Pose::isometry)
    }

    /// Returns the cable that a full step winds, metres; the longest of the motors.
    pub(super) fn cable_per_step(&self) -> f64 {
        let radius = self.pulley_radii.iter().map(|radius| radius.get()).fold(0.0, f64::max);
        std::f64::consts::TAU * radius / FULL_STEPS_PER_REVOLUTION
    }

    /// Returns the ball's first position, metres in the rig frame.
    pub fn start(&self) -> Point3<f64> {
        Point3::from(self.start.map(Coordinate::get))
    }
}

/// Motor of a simulated rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum SimulatedMotor {
    /// Motor A.
    A,
    /// Motor B.
    B,
    /// Motor C.
    C,
}

/// Simulated motor on each output of the board. Each motor is on one output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "MotorList<SimulatedMotor>")]
pub struct Wiring(MotorList<SimulatedMotor>);

/// Wiring with one motor on two outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("one motor is on two outputs of the board; each must be there once")]
pub struct WiringError;

impl Wiring {
    /// Returns the number (A 0, B 1, C 2) of the motor on each output of the board.
    pub fn motors(&self) -> MotorList<usize> {
        self.0.map(|motor| motor as usize)
    }
}

impl Default for Wiring {
    /// Returns each motor on its own output.
    fn default() -> Self {
        Self(MotorList::new([SimulatedMotor::A, SimulatedMotor::B, SimulatedMotor::C]))
    }
}

impl TryFrom<MotorList<SimulatedMotor>> for Wiring {
    type Error = WiringError;

    fn try_from(motors: MotorList<SimulatedMotor>) -> Result<Self, WiringError> {
        let is_there = |motor: usize| motors.iter().any(|it| *it as usize == motor);
        if (0..motors.len()).all(is_there) { Ok(Self(motors)) } else { Err(WiringError) }
    }
}

/// Names of the motors.
const EXACT: [&str; 3] = ["A", "B", "C"];

/// Names of motors whose places are approximate.
const APPROXIMATE: [&str; 3] = ["A (approximate)", "B (approximate)", "C (approximate)"];

/// Motor points of a rig, for pictures and checks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorPoints {
    /// Place of each motor, metres in the rig frame.
    pub places: MotorList<Point3<f64>>,
    /// Whether a person has measured them: they come from the table `[size]`.
    pub is_approximate: bool,
}

impl MotorPoints {
    /// Returns the names of the motors, with a mark where their places are approximate.
    pub fn names(&self) -> [&'static str; 3] {
        if self.is_approximate { APPROXIMATE } else { EXACT }
    }
}
