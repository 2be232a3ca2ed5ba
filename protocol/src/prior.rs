//! What a host knows of a rig before the law has learnt anything.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::dimension::{LEAST_MOTORS, MotorList, PerAxis};
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

impl Prior {
    /// Returns whether the prior is of as many `motors`, and within its ranges.
    pub fn is_valid(&self, motors: usize) -> bool {
        match self {
            Self::Jacobian(prior) => prior.is_valid(motors),
            Self::Rig(prior) => prior.is_valid(motors),
        }
    }
}

/// Entries of the Jacobian, and how far they may be off.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct JacobianPrior {
    /// J, µm of the ball for a full step, + pays out; at most [`MAX_ENTRY`](Self::MAX_ENTRY).
    pub entries: PerAxis<MotorList<i32>>,
    /// Standard deviation of each entry alone, in the same unit; at most
    /// [`MAX_DEVIATION`](Self::MAX_DEVIATION).
    pub deviations: PerAxis<MotorList<u32>>,
    /// Standard deviation that the entries of a row have in common, as a share of each, 1/256.
    pub common: u8,
}

impl JacobianPrior {
    /// Largest magnitude of an entry, µm/step: a step of 4 mm.
    pub const MAX_ENTRY: u32 = 4000;
    /// Largest standard deviation of an entry, µm/step.
    pub const MAX_DEVIATION: u32 = 500;

    /// See [`Prior::is_valid`]. Two motors do not move the ball along x.
    fn is_valid(&self, motors: usize) -> bool {
        let is_zero = |axis: usize| {
            self.entries[axis].iter().all(|j| *j == 0)
                && self.deviations[axis].iter().all(|sd| *sd == 0)
        };
        let is_row = |row: &MotorList<_>| {
            row.len() == motors && row.iter().all(|j: &i32| j.unsigned_abs() <= Self::MAX_ENTRY)
        };
        let is_doubt = |row: &MotorList<_>| {
            row.len() == motors && row.iter().all(|sd: &u32| *sd <= Self::MAX_DEVIATION)
        };
        self.entries.iter().all(is_row)
            && self.deviations.iter().all(is_doubt)
            && (motors > LEAST_MOTORS || is_zero(0))
    }
}

/// Places of the motors and the cable of a step, and how far they may be off.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct RigPrior {
    /// Where the cables leave the motors, in the rig frame.
    pub motors: MotorList<Point>,
    /// Standard deviation of each coordinate, above 0.
    pub deviation: Micrometres,
    /// Cable of a full step of each motor, nm; above 0.
    pub cable_per_step: MotorList<u32>,
    /// Standard deviation of the cable of a step, as a share of it, 1/1024; above 0.
    pub cable_deviation: u16,
}

impl RigPrior {
    /// See [`Prior::is_valid`].
    fn is_valid(&self, motors: usize) -> bool {
        let counts = [self.motors.len(), self.cable_per_step.len()];
        counts == [motors; 2]
            && self.deviation.0 > 0
            && self.cable_deviation > 0
            && self.cable_per_step.iter().all(|cable| *cable > 0)
    }
}
