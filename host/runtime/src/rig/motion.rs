//! Motions of the ball that a rig allows, as far as its file tells, and the tables `[jog]` and
//! `[path]` with limits of motions.

use std::fmt;

use nalgebra::{Point3, Vector3};
use plumb_config::quantity::Coordinate;
use plumb_protocol::config::{JogLimits, PathLimits};
use plumb_protocol::units::{Micrometres, PathAcceleration, PathJerk, Point, Rate, Speed, Steps16};
use serde::Deserialize;
use thiserror::Error;

use super::check::size::RoughSize;
use super::quantity::{
    Conversion, Distance, JogDistance, MotorRate, ReferenceAcceleration, ReferenceJerk,
    ReferenceSpeed,
};
use super::{Box3, Rig};
use crate::rounding::round;

/// Names of the motors.
const MOTORS: [char; 3] = ['A', 'B', 'C'];

/// Names of the axes of the rig frame.
const AXES: [char; 3] = ['x', 'y', 'z'];

/// Distance beyond the border of the workspace at which a target still is inside, metres: half of
/// the board's unit.
const ROUNDING_M: f64 = 0.5e-6;

/// Largest coordinate of a place from which on it may be in another unit than metres: a workspace
/// reaches to 4 m.
const LEAST_IN_OTHER_UNIT: f64 = 10.0;

/// Rules for a motion of the ball, from the rig file.
#[derive(Debug, Clone)]
pub struct MotionRules {
    workspace: Box3,
    /// Rough size, if it is known.
    size: Option<RoughSize>,
    /// Highest rate of the motors, full steps/s.
    max_rate: f64,
}

/// Motion of the ball that the rig does not allow.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum MotionError {
    /// The place is outside the workspace.
    #[error("that is outside the workspace of the rig file: {0}")]
    Workspace(Outside),
    /// The place is outside the triangle of the motors.
    #[error("that is outside the triangle of the motors, where a cable is slack")]
    Triangle,
    /// A motor is too slow.
    #[error("{}: {}", too_fast(*.motor, *.rate, *.limit), lower_speed(limit / rate))]
    MotorRate {
        /// Name of the motor.
        motor: char,
        /// Rate, full steps/s.
        rate: f64,
        /// Limit, full steps/s.
        limit: f64,
    },
}

/// Returns what a motor cannot do, without advice.
fn too_fast(motor: char, rate: f64, limit: f64) -> String {
    format!(
        "motor {motor} would have to turn at {rate:.1} full steps/s, above `motors.max_rate = \
         {limit}`"
    )
}

/// Returns the advice to choose a speed of which `share` is the highest that is possible.
fn lower_speed(share: f64) -> String {
    match (share * 100.0).floor() {
        percent if percent >= 1.0 => {
            format!("choose a lower speed, at most {percent:.0} % of this one")
        }
        _ => "choose a far lower speed, or check the units".to_owned(),
    }
}

impl MotionError {
    /// Returns the error without advice about the speed, for a motion whose times are given.
    pub fn without_advice(&self) -> String {
        match *self {
            Self::MotorRate { motor, rate, limit } => too_fast(motor, rate, limit),
            _ => self.to_string(),
        }
    }

    /// Returns the unit in which the place probably is, in place of metres.
    pub fn other_unit(&self) -> Option<MistakenUnit> {
        match self {
            Self::Workspace(outside) => outside.unit,
            Self::Triangle | Self::MotorRate { .. } => None,
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

impl Rig {
    /// Returns the rules for a motion of the ball. Triangle and rates of the motors are checked
    /// where the rig file has the table `[size]` or `[simulation]`.
    pub fn motion_rules(&self) -> MotionRules {
        MotionRules {
            workspace: self.workspace,
            size: RoughSize::of(self),
            max_rate: self.motors.max_rate.get(),
        }
    }
}

impl MotionRules {
    /// Checks a place of the ball, metres, and its velocity there, m/s.
    ///
    /// # Errors
    /// The first rule that the motion breaks.
    pub fn check(&self, place: Point3<f64>, velocity: Vector3<f64>) -> Result<(), MotionError> {
        self.check_workspace(place, 0.0)?;
        self.check_triangle(place)?;
        for (rate, motor) in self.rates(place, velocity).zip(MOTORS) {
            if rate > self.max_rate {
                return Err(MotionError::MotorRate { motor, rate, limit: self.max_rate });
            }
        }
        Ok(())
    }

    /// Returns how fast the motors turn for a motion of the ball, as a share of their limit: that
    /// of the fastest; 0 where nothing tells where they are.
    pub fn rate_share(&self, place: Point3<f64>, velocity: Vector3<f64>) -> f64 {
        self.rates(place, velocity).fold(0.0, f64::max) / self.max_rate
    }

    /// Returns the rates of the motors for a motion of the ball, full steps/s; none where nothing
    /// tells where they are.
    fn rates(&self, place: Point3<f64>, velocity: Vector3<f64>) -> impl Iterator<Item = f64> {
        self.size.iter().flat_map(move |size| {
            size.motors.iter().map(move |position| {
                // The speed of the cable is the ball's along it.
                let cable = place - position;
                (cable.dot(&velocity) / cable.norm()).abs() / size.cable_per_step
            })
        })
    }

    /// Returns a target (metres) in the board's units.
    ///
    /// # Errors
    /// Where it is outside the workspace or the triangle of the motors.
    pub(crate) fn target(&self, target: [f64; 3]) -> Result<Point, MotionError> {
        self.check_workspace(target.into(), ROUNDING_M)?;
        self.check_triangle(target.into())?;
        // A workspace reaches to 4 m, the board's units to 2147 m.
        Ok(Point::from_metres(target).unwrap_or_default())
    }

    /// Returns the targets (metres) that the rules do not allow, in their order.
    pub(crate) fn wrong_targets(
        &self,
        targets: impl IntoIterator<Item = [f64; 3]>,
    ) -> Vec<WrongTarget> {
        let wrong = |(number, target)| {
            let error = self.target(target).err()?;
            Some(WrongTarget { number, target, error })
        };
        (1..).zip(targets).filter_map(wrong).collect()
    }

    /// Returns whether the rules know where the motors are. Else they know the workspace only.
    pub fn know_the_motors(&self) -> bool {
        self.size.is_some()
    }

    /// Returns the distance of a place (metres) from the border of the workspace, metres; negative
    /// outside.
    pub(super) fn room(&self, place: [f64; 3]) -> f64 {
        let Box3 { min, max } = &self.workspace;
        let room = |i: usize| (place[i] - min[i].get()).min(max[i].get() - place[i]);
        (0..place.len()).map(room).fold(f64::INFINITY, f64::min)
    }

    /// Checks that a place is inside the workspace, or beyond its border by at most `margin`; both
    /// in metres.
    fn check_workspace(&self, place: Point3<f64>, margin: f64) -> Result<(), MotionError> {
        let Some((index, side)) = self.outside(place, margin) else { return Ok(()) };
        let Box3 { min, max } = &self.workspace;
        let limit = if side == Side::Below { min } else { max }[index];
        Err(MotionError::Workspace(Outside {
            axis: AXES[index],
            value_m: place[index],
            side,
            limit_m: limit.get(),
            unit: self.other_unit(place),
        }))
    }

    /// Returns the first axis along which a place is outside the workspace by more than `margin`,
    /// and its side.
    fn outside(&self, place: Point3<f64>, margin: f64) -> Option<(usize, Side)> {
        let Box3 { min, max } = &self.workspace;
        (0..3).find_map(|index| match place[index] {
            value if value < min[index].get() - margin => Some((index, Side::Below)),
            value if value <= max[index].get() + margin => None,
            _ => Some((index, Side::Above)),
        })
    }

    /// Returns the unit in which a place (metres) is inside the workspace; `None` where there is
    /// none, or the place could be one of a rig.
    fn other_unit(&self, place: Point3<f64>) -> Option<MistakenUnit> {
        let is_inside = |per_metre: f64| self.outside(place / per_metre, 0.0).is_none();
        let all_below = |most_m: f64| place.iter().all(|coordinate| coordinate.abs() < most_m);
        if all_below(LEAST_IN_OTHER_UNIT) {
            let is_tiny = all_below(LEAST_IN_OTHER_UNIT / 1000.0) && is_inside(1e-3);
            return is_tiny.then_some(MistakenUnit::Metres);
        }
        match (is_inside(1000.0), is_inside(100.0)) {
            (true, false) => Some(MistakenUnit::Millimetres),
            (false, true) => Some(MistakenUnit::Centimetres),
            (true, true) => Some(MistakenUnit::Either),
            // No rig is so far from its origin.
            (false, false) => {
                let is_far = |it: &f64| it.is_finite() && !Coordinate::RANGE.contains(*it);
                place.iter().any(is_far).then_some(MistakenUnit::Millimetres)
            }
        }
    }

    fn check_triangle(&self, place: Point3<f64>) -> Result<(), MotionError> {
        match &self.size {
            Some(size) if !size.contains(place) => Err(MotionError::Triangle),
            _ => Ok(()),
        }
    }
}

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

#[cfg(test)]
mod tests {
    use super::super::quantity::Corner;
    use super::*;

    fn check(rig: &Rig, place: [f64; 3], speed: f64) -> Result<(), MotionError> {
        rig.motion_rules().check(place.into(), Vector3::new(0.0, 0.0, -speed))
    }

    #[test]
    fn workspace_triangle_and_motors_are_checked() {
        let rig = Rig::paper().unwrap();
        assert_eq!(check(&rig, [0.54, 0.22, 0.4], 0.1), Ok(()));
        let error = check(&rig, [0.54, 0.22, 0.7], 0.1).unwrap_err().to_string();
        let named = "that is outside the workspace of the rig file: z = 0.7 m is above the 0.6 m \
                     of `workspace.max`";
        assert_eq!(error, named);
        // In the workspace, beside the line from C to A.
        assert_eq!(check(&rig, [0.1, 0.5, 0.4], 0.1), Err(MotionError::Triangle));
        let error = check(&rig, [0.54, 0.22, 0.1], 1.0).unwrap_err();
        assert!(matches!(error, MotionError::MotorRate { motor: 'A', .. }), "{error}");
    }

    #[test]
    fn the_room_of_a_place_is_its_distance_from_the_border() {
        let rules = Rig::paper().unwrap().motion_rules();
        for (place, room) in [([0.54, 0.22, 0.59], 0.01), ([0.54, 0.22, 0.63], -0.03)] {
            assert!((rules.room(place) - room).abs() < 1e-9, "{place:?}: {}", rules.room(place));
        }
    }

    #[test]
    fn a_lower_speed_is_never_one_of_0_percent() {
        let error = |rate| MotionError::MotorRate { motor: 'A', rate, limit: 400.0 };
        assert!(error(1000.0).to_string().ends_with("lower speed, at most 40 % of this one"));
        let text = error(1e6).to_string();
        assert!(text.ends_with("400`: choose a far lower speed, or check the units"), "{text}");
        assert!(error(1e6).without_advice().ends_with("`motors.max_rate = 400`"));
    }

    #[test]
    fn a_place_in_another_unit_is_asked_for() {
        let rig = Rig::paper().unwrap();
        for (place, unit) in [
            ([420.0, 240.0, 300.0], "; is it in millimetres?"),
            ([42.0, 24.0, 30.0], "; is it in centimetres?"),
            // 0.42 m is inside, and 900 m are no rig's.
            ([900.0, 240.0, 300.0], "; is it in millimetres?"),
            ([90.0, 24.0, 30.0], "`workspace.max`"),
            ([2.0, 0.3, 0.3], "`workspace.max`"),
            ([0.00042, 0.00024, 0.0003], "; is it in metres, where the file says millimetres?"),
            ([0.0, 0.0, 0.0], "`workspace.min`"),
            ([f64::NAN, 0.3, 0.3], "`workspace.max`"),
        ] {
            let error = check(&rig, place, 0.0).unwrap_err().to_string();
            assert!(error.ends_with(unit), "{place:?}: {error}");
        }
        let [min, max] = [-4.0, 4.0].map(|border| [Corner::constant(border); 3]);
        let wide = Rig { workspace: Box3 { min, max }, ..rig };
        let error = check(&wide, [42.0, 24.0, 30.0], 0.0).unwrap_err().to_string();
        assert!(error.ends_with("; is it in millimetres or centimetres?"), "{error}");
    }

    #[test]
    fn a_rig_of_unknown_size_has_a_workspace_only() {
        let rig = Rig { simulation: None, ..Rig::paper().unwrap() };
        assert_eq!(check(&rig, [0.1, 0.5, 0.4], 9.0), Ok(()));
        let error = check(&rig, [0.0, 0.5, 0.4], 0.0).unwrap_err().to_string();
        assert!(error.ends_with("x = 0 m is below the 0.1 m of `workspace.min`"), "{error}");
    }
}
