//! Tables `[simulation]` and `[size]` of a rig file: the simulated rig with its wiring, the rough
//! size of a rig, and its motor points for the outputs that draw it.

use nalgebra::{Isometry3, Point3};
use plumb_cameras::camera_file::Pose;
use plumb_config::quantity::Coordinate;
use serde::Deserialize;
use thiserror::Error;

use super::Rig;
use super::quantity::{CablePerStep, PulleyRadius};

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

/// Simulated motors on the outputs A, B, C of the board. Each motor is on one output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "[SimulatedMotor; 3]")]
pub struct Wiring([SimulatedMotor; 3]);

/// Wiring with one motor on two outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("one motor is on two outputs of the board; A, B and C must each be there once")]
pub struct WiringError;

impl Wiring {
    /// Returns the number (A 0, B 1, C 2) of the motor on each output of the board.
    pub fn motors(&self) -> [usize; 3] {
        self.0.map(|motor| motor as usize)
    }
}

impl Default for Wiring {
    /// Returns each motor on its own output.
    fn default() -> Self {
        Self([SimulatedMotor::A, SimulatedMotor::B, SimulatedMotor::C])
    }
}

impl TryFrom<[SimulatedMotor; 3]> for Wiring {
    type Error = WiringError;

    fn try_from(motors: [SimulatedMotor; 3]) -> Result<Self, WiringError> {
        let [a, b, c] = motors;
        if a == b || b == c || c == a { Err(WiringError) } else { Ok(Self(motors)) }
    }
}

/// Names of the motors.
const EXACT: [&str; 3] = ["A", "B", "C"];

/// Names of motors whose places are approximate.
const APPROXIMATE: [&str; 3] = ["A (approximate)", "B (approximate)", "C (approximate)"];

/// Motor points of a rig. No law uses them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorPoints {
    /// Places of motors A, B, C, metres in the rig frame.
    pub places: [Point3<f64>; 3],
    /// Whether a person has measured them: they come from the table `[size]`.
    pub is_approximate: bool,
}

impl MotorPoints {
    /// Returns the names of the motors, with a mark where their places are approximate.
    pub fn names(&self) -> [&'static str; 3] {
        if self.is_approximate { APPROXIMATE } else { EXACT }
    }
}

impl Rig {
    /// Returns the motor points, by the table `[simulation]` of a simulated rig, or else by
    /// `[size]`; `None` where the rig file has neither.
    pub fn motor_points(&self) -> Option<MotorPoints> {
        let exact = self.simulation.as_ref().map(Simulation::motors);
        let exact = exact.map(|places| MotorPoints { places, is_approximate: false });
        let rough = || {
            let places = self.size.as_ref().map(Size::motors)?;
            Some(MotorPoints { places, is_approximate: true })
        };
        exact.or_else(rough)
    }
}

/// Rough size of a rig. It serves checks of the rig file and jogs in millimetres. No law uses it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Size {
    /// Places where the cables leave motors A, B, C, metres in the rig frame.
    pub motors: [[Coordinate; 3]; 3],
    /// Height of the floor in the rig frame, metres.
    #[serde(default)]
    pub floor: Coordinate,
    /// Cable that a full step winds, metres.
    pub cable_per_step: CablePerStep,
}

impl Size {
    /// Returns the places of motors A, B, C, metres in the rig frame.
    pub fn motors(&self) -> [Point3<f64>; 3] {
        self.motors.map(|motor| Point3::from(motor.map(Coordinate::get)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_places_of_a_simulated_rig_are_exact_and_measured_ones_approximate() {
        let rig = Rig::paper().unwrap();
        let exact = rig.motor_points().unwrap();
        assert_eq!((exact.is_approximate, exact.names()), (false, ["A", "B", "C"]));
        let unknown = Rig { simulation: None, size: None, ..rig.clone() };
        assert_eq!(unknown.motor_points(), None);
        let size: Size = toml::from_str(
            "motors = [[1.0, 0.7, 0.6], [1.0, 0.0, 0.6], [0.0, 0.4, 0.6]]\n\
             cable_per_step = 0.0005",
        )
        .unwrap();
        let measured = Rig { size: Some(size), ..unknown }.motor_points().unwrap();
        assert_eq!((measured.is_approximate, measured.names()[2]), (true, "C (approximate)"));
        assert_eq!(measured.places[1], Point3::new(1.0, 0.0, 0.6));
    }
}
