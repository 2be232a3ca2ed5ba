//! What a host knows of a rig before the law has learnt anything.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::dimension::{MotorList, PerAxis};
use crate::units::{Micrometres, Point};

/// Knowledge of a rig with which a law begins: [`Command::Prior`](crate::Command::Prior). Grows at
/// its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Prior {
    /// The Jacobian where the ball is, for the law [`Adaptive`](crate::config::Law::Adaptive).
    Jacobian(JacobianPrior),
    /// The rig, for the law [`Taut`](crate::config::Law::Taut).
    Rig(RigPrior),
}

/// Entries of the Jacobian, and how far they may be off.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct JacobianPrior {
    /// J, µm of the ball for a full step, + pays out.
    pub entries: PerAxis<MotorList<i32>>,
    /// Standard deviation of each entry alone, in the same unit.
    pub deviations: PerAxis<MotorList<u32>>,
    /// Standard deviation that the entries of a row have in common, as a share of each, 1/256.
    pub common: u8,
}

/// Places of the motors and the cable of a step, and how far they may be off.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct RigPrior {
    /// Where the cables leave the motors, in the rig frame.
    pub motors: MotorList<Point>,
    /// Standard deviation of each coordinate.
    pub deviation: Micrometres,
    /// Cable of a full step of each motor, nm.
    pub cable_per_step: MotorList<u32>,
    /// Standard deviation of the cable of a step, as a share of it, 1/1024.
    pub cable_deviation: u16,
}
