//! Tables `[jog]` and `[path]` of a rig file: the limits of jogs and of a moving reference.

use plumb_protocol::config::{JogLimits, PathLimits};
use plumb_protocol::units::{Micrometres, PathAcceleration, PathJerk, Rate, Speed, Steps16};
use serde::Deserialize;

use super::quantity::{
    Conversion, Distance, JogDistance, MotorRate, ReferenceAcceleration, ReferenceJerk,
    ReferenceSpeed,
};

/// Limits of jogs: table `[jog]` of a rig file. See [`plumb_protocol::config::JogLimits`]. The
/// defaults are a revolution of a motor with 200 steps, and a quarter of a revolution in a second.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JogSettings {
    /// Highest rate of a jog, full steps/s.
    pub max_rate: MotorRate,
    /// Longest distance of one jog, full steps.
    pub max_distance: JogDistance,
}

impl Default for JogSettings {
    fn default() -> Self {
        Self { max_rate: MotorRate::constant(50.0), max_distance: JogDistance::constant(200.0) }
    }
}

impl JogSettings {
    /// Returns the limits in the board's units.
    pub(super) fn convert(&self, conversion: &mut Conversion) -> JogLimits {
        let (rate, distance) = (self.max_rate.get(), self.max_distance.get());
        JogLimits {
            max_rate: conversion.fit("jog.max_rate", rate, Rate::from_si),
            max_distance: conversion.fit("jog.max_distance", distance, Steps16::from_si),
        }
    }
}

/// Limits of a reference that moves: table `[path]` of a rig file. See
/// [`plumb_protocol::config::PathLimits`].
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
