//! Limits of jogs.

use plumb_protocol::config::JogLimits;
use plumb_protocol::units::{Rate, Steps16};
use serde::Deserialize;

use super::conversion::Conversion;
use super::quantity::{JogDistance, MotorRate};

/// See [`plumb_protocol::config::JogLimits`]. The defaults are a revolution of a motor with 200
/// steps, and a quarter of a revolution in a second.
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
