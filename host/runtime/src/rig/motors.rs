//! Limits of the motors, as in rig files.

use plumb_protocol::config::Motor;
use plumb_protocol::units::{Acceleration, Rate, Steps16};
use serde::Deserialize;

use super::Driver;
use super::conversion::Conversion;
use super::quantity::{MotorAcceleration, MotorRate, TravelLimit};

/// Limits of the motors, and their drivers.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motors {
    /// Highest rate, full steps/s.
    pub max_rate: MotorRate,
    /// Highest acceleration, full steps/s².
    pub max_acceleration: MotorAcceleration,
    /// Microsteps in a full step: 1, 2, 4, 8 or 16.
    pub microsteps: u8,
    /// Lowest and highest position, full steps from where the board started.
    pub travel: [TravelLimit; 2],
    /// Whether A, B, C turn the wrong way round.
    #[serde(default)]
    pub reversed: [bool; 3],
    /// The drivers of the motors.
    #[serde(default)]
    pub driver: Driver,
}

impl Motors {
    /// Returns the motors A, B and C in the board's units.
    pub(super) fn convert(&self, conversion: &mut Conversion) -> [Motor; 3] {
        let (rate, acceleration) = (self.max_rate.get(), self.max_acceleration.get());
        let [min, max] = self.travel.map(TravelLimit::get);
        let motor = Motor {
            max_rate: conversion.fit("motors.max_rate", rate, Rate::from_si),
            max_acceleration: conversion.fit(
                "motors.max_acceleration",
                acceleration,
                Acceleration::from_si,
            ),
            travel_min: conversion.fit("motors.travel", min, Steps16::from_si),
            travel_max: conversion.fit("motors.travel", max, Steps16::from_si),
            reversed: false,
        };
        self.reversed.map(|reversed| Motor { reversed, ..motor })
    }
}
