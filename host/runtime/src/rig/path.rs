//! Limits of a reference that moves.

use plumb_protocol::config::PathLimits;
use plumb_protocol::units::{Micrometres, PathAcceleration, PathJerk, Speed};
use serde::Deserialize;

use super::conversion::Conversion;
use super::quantity::{Distance, ReferenceAcceleration, ReferenceJerk, ReferenceSpeed};

/// See [`plumb_protocol::config::PathLimits`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PathSettings {
    /// Highest speed of the reference, m/s.
    pub max_speed: ReferenceSpeed,
    /// Highest acceleration of the reference, m/s².
    pub max_acceleration: ReferenceAcceleration,
    /// Highest jerk of the reference, m/s³.
    pub max_jerk: ReferenceJerk,
    /// Distance of the ball from the reference at which a path that waits stands still, metres.
    pub deviation: Distance,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self {
            max_speed: ReferenceSpeed::constant(0.3),
            max_acceleration: ReferenceAcceleration::constant(1.0),
            max_jerk: ReferenceJerk::constant(10.0),
            deviation: Distance::constant(0.02),
        }
    }
}

impl PathSettings {
    /// Returns the limits in the board's units.
    pub(super) fn convert(&self, conversion: &mut Conversion) -> PathLimits {
        let Self { max_speed, max_acceleration, max_jerk, deviation } = *self;
        PathLimits {
            speed: conversion.fit("path.max_speed", max_speed.get(), Speed::from_si),
            acceleration: conversion.fit(
                "path.max_acceleration",
                max_acceleration.get(),
                PathAcceleration::from_si,
            ),
            jerk: conversion.fit("path.max_jerk", max_jerk.get(), PathJerk::from_si),
            deviation: conversion.fit("path.deviation", deviation.get(), Micrometres::from_si),
        }
    }
}
