//! Limits of a reference that moves.

use plumb_cameras::toml_file::Positive;
use plumb_protocol::config::PathLimits;
use plumb_protocol::units::{Micrometres, PathAcceleration, PathJerk, Speed};
use serde::Deserialize;

use super::conversion::Conversion;
use super::positive;

/// See [`plumb_protocol::config::PathLimits`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PathSettings {
    /// Highest speed of the reference, m/s.
    pub max_speed: Positive,
    /// Highest acceleration of the reference, m/s².
    pub max_acceleration: Positive,
    /// Highest jerk of the reference, m/s³.
    pub max_jerk: Positive,
    /// Distance of the ball from the reference at which a path that waits stands still, metres.
    pub deviation: Positive,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self {
            max_speed: positive(0.3),
            max_acceleration: positive(1.0),
            max_jerk: positive(10.0),
            deviation: positive(0.02),
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
