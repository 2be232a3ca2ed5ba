//! Table `[size]` of a rig file.

use nalgebra::Point3;
use plumb_config::quantity::Coordinate;
use serde::Deserialize;

use super::quantity::CablePerStep;

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
