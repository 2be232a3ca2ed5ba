//! What a rig does not allow of a motion of the ball, in words for people.

use std::fmt;

use thiserror::Error;

use crate::rounding::round;

/// Motion of the ball that the rig does not allow.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum MotionError {
    /// The place is outside the workspace.
    #[error("that is outside the workspace of the rig file: {0}")]
    Workspace(Outside),
    /// The place is outside the triangle of the motors.
    #[error("that is outside the triangle of the motors, where a cable is slack")]
    Triangle,
    /// The place is outside the part of the picture where targets may be.
    #[error("pixel {pixel:?} is too near to the border of the picture or to the motors")]
    Picture {
        /// Column and row, pixels.
        pixel: [f64; 2],
    },
    /// No place is inside the workspace.
    #[error(
        "the workspace of the rig file has no room along {axis}: `workspace.min` must be below \
         `workspace.max` in each coordinate"
    )]
    NoRoom {
        /// Name of the axis.
        axis: char,
    },
    /// No place is inside the triangle of the motors.
    #[error(
        "the motors are on a line, seen from above, and no place is between them: they must be \
         the corners of a triangle"
    )]
    Line,
    /// A motor is too slow.
    // Rounded up: a rate just above the limit is not written as the limit.
    #[error(
        "motor {motor} would have to turn at {:.1} full steps/s, above `motors.max_rate = {limit}`",
        (rate * 10.0).ceil() / 10.0
    )]
    MotorRate {
        /// Name of the motor.
        motor: char,
        /// Rate, full steps/s.
        rate: f64,
        /// Limit, full steps/s.
        limit: f64,
    },
}

impl MotionError {
    /// Returns whether the rig file is wrong for every place.
    pub(crate) fn is_of_the_rig(&self) -> bool {
        matches!(self, Self::NoRoom { .. } | Self::Line)
    }

    /// Returns the unit in which the place probably is, in place of metres.
    pub fn other_unit(&self) -> Option<MistakenUnit> {
        match self {
            Self::Workspace(outside) => outside.unit,
            _ => None,
        }
    }
}

/// Target that the rig does not allow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrongTarget {
    /// Its number, from 1.
    pub number: usize,
    /// Its place, metres.
    pub target: [f64; 3],
    /// Broken rule.
    pub error: MotionError,
}

/// Target so near to the border of the workspace that a ball counted as reached may be outside,
/// where the board stops it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetAtBorder {
    /// Its number, from 1.
    pub number: usize,
    /// Distance of the target from the border, metres.
    pub room_m: f64,
    /// Distance that is enough, metres: the radius of "reached".
    pub enough_m: f64,
}

impl fmt::Display for TargetAtBorder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.0} mm from the border of the workspace: the board stops if the ball swings across \
             it; {:.0} mm are enough",
            self.room_m * 1e3,
            self.enough_m * 1e3
        )
    }
}

/// Coordinate of a place beyond the workspace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outside {
    /// Name of the axis.
    pub axis: char,
    /// Coordinate, metres.
    pub value_m: f64,
    /// Side of the workspace on which it is.
    pub side: Side,
    /// Border of the workspace on this side, metres.
    pub limit_m: f64,
    /// Unit in which the place probably is, in place of metres.
    pub unit: Option<MistakenUnit>,
}

/// Unit of length that a place in metres was written in by mistake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MistakenUnit {
    /// Millimetres.
    Millimetres,
    /// Centimetres.
    Centimetres,
    /// One of both.
    Either,
    /// Metres, where the number was taken for millimetres, as in G-code.
    Metres,
}

impl fmt::Display for MistakenUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Millimetres => "millimetres",
            Self::Centimetres => "centimetres",
            Self::Either => "millimetres or centimetres",
            Self::Metres => "metres, where the file says millimetres",
        })
    }
}

/// Side of the workspace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Below `workspace.min`.
    Below,
    /// Above `workspace.max`.
    Above,
}

impl fmt::Display for Outside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (side, key) = match self.side {
            Side::Below => ("below", "min"),
            Side::Above => ("above", "max"),
        };
        let Self { axis, value_m, limit_m, .. } = self;
        let value_m = round(*value_m, 1e6);
        write!(f, "{axis} = {value_m} m is {side} the {limit_m} m of `workspace.{key}`")?;
        self.unit.map_or(Ok(()), |unit| write!(f, "; is it in {unit}?"))
    }
}
