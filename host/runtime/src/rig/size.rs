//! Sizes in a rig file: the workspace, the table `[size]`, and the rough size of a rig.

use nalgebra::{Point2, Point3};
use plumb_config::quantity::Coordinate;
use plumb_protocol::MotorList;
use plumb_protocol::prior::RigPrior;
use plumb_protocol::units::{Micrometres, Point};
use serde::Deserialize;

use super::quantity::{CABLE_PER_TURN_RANGE_M, CablePerStep, Corner, FULL_STEPS_PER_REVOLUTION};
use super::simulation::Simulation;

/// Least area of the triangle of the motors, seen from above, m²: that of a simulated rig
/// (`LEAST_AREA_M2` of firmware/emulator/src/plant/geometry.rs).
const LEAST_AREA_M2: f64 = 1e-6;

/// Least distance of two motors, seen from above, metres.
const LEAST_DISTANCE_M: f64 = 1e-3;

/// Box in the rig frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Box3 {
    /// Corner of smallest coordinates, metres.
    pub min: [Corner; 3],
    /// Corner of largest coordinates, metres.
    pub max: [Corner; 3],
}

impl Box3 {
    /// Largest workspace of two motors that a board takes.
    pub(super) const WIDEST_PLANE: Self = {
        let none = Corner::constant(0.0);
        let (low, high) = (Corner::constant(-4.0), Corner::constant(4.0));
        Self { min: [none, low, low], max: [none, high, high] }
    };
}

/// Standard deviation of a coordinate by tape measure, metres.
const TAPE_SD_M: f64 = 0.02;
/// Standard deviation of the cable of a step by tape measure, as a share.
const TAPE_SD_SHARE: f64 = 0.1;

/// Rough size of a rig. It serves checks of the rig file and jogs in millimetres, and the law taut
/// begins with it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Size {
    /// Places where the cables leave the motors, metres in the rig frame.
    pub motors: MotorList<[Coordinate; 3]>,
    /// Height of the floor in the rig frame, metres.
    #[serde(default)]
    pub floor: Coordinate,
    /// Cable that a full step winds, metres.
    pub cable_per_step: CablePerStep,
}

impl Size {
    /// Returns the places of the motors, metres in the rig frame.
    pub fn motors(&self) -> MotorList<Point3<f64>> {
        self.motors.map(|motor| Point3::from(motor.map(Coordinate::get)))
    }

    /// Returns what the law taut begins with; `None` for motors that do not stand as the rig frame
    /// demands, and for a cable that no drum winds.
    pub fn prior(&self) -> Option<RigPrior> {
        let cable = self.cable_per_step.get();
        let is_drum = cable <= CABLE_PER_TURN_RANGE_M[1] / FULL_STEPS_PER_REVOLUTION;
        let rough = RoughSize::of(Some(self), None)?;
        (is_drum && rough.is_in_rig_frame()).then(|| RigPrior {
            // The ranges of the keys are within those of the wire.
            motors: rough.motors.map(|motor| Point::from_metres(motor.into()).unwrap_or_default()),
            deviation: Micrometres((TAPE_SD_M * 1e6).round() as i32),
            cable_per_step: rough.motors.map(|_| (cable * 1e9).round() as u32),
            cable_deviation: (TAPE_SD_SHARE * 1024.0) as u16,
        })
    }
}

/// Rough size of a rig.
#[derive(Debug, Clone)]
pub(super) struct RoughSize {
    /// Key of the motors' places.
    pub(super) key: &'static str,
    pub(super) motors: MotorList<Point3<f64>>,
    pub(super) floor: f64,
    /// Cable of a full step, metres; the longest of the motors.
    pub(super) cable_per_step: f64,
}

impl RoughSize {
    /// Returns the size from the table `[size]`, or else that of the simulated rig.
    pub(super) fn of(size: Option<&Size>, simulation: Option<&Simulation>) -> Option<Self> {
        if let Some(size) = size {
            return Some(Self {
                key: "size.motors",
                motors: size.motors(),
                floor: size.floor.get(),
                cable_per_step: size.cable_per_step.get(),
            });
        }
        let simulation = simulation?;
        Some(Self {
            key: "simulation.motors",
            motors: simulation.motors(),
            floor: 0.0,
            cable_per_step: simulation.cable_per_step(),
        })
    }

    /// Returns whether a point is inside the triangle of the motors, seen from above; between two
    /// motors, in the plane x = 0.
    pub(super) fn contains(&self, point: Point3<f64>) -> bool {
        let [a, b, c] = match self.motors[..] {
            [a, b, c] => [a, b, c].map(|motor| motor.xy()),
            [a, b] => return point.x == 0.0 && b.y <= point.y && point.y <= a.y,
            _ => return false,
        };
        let side = |p: Point2<f64>, q: Point2<f64>| (q - p).perp(&(point.xy() - p));
        let sides = [side(a, b), side(b, c), side(c, a)];
        sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)
    }

    /// Returns whether three motors are on a line, seen from above, or two above one another.
    pub(super) fn is_line(&self) -> bool {
        match self.motors[..] {
            [a, b, c] => (b - a).xy().perp(&(c - a).xy()).abs() / 2.0 < LEAST_AREA_M2,
            [a, b] => (a.y - b.y).abs() < LEAST_DISTANCE_M,
            _ => true,
        }
    }

    /// Returns whether the motors stand as the rig frame demands: y from B to A, C between them
    /// and at smaller x; two in the plane x = 0.
    pub(super) fn is_in_rig_frame(&self) -> bool {
        match self.motors[..] {
            [a, b, c] => b.y < c.y && c.y < a.y && c.x < a.x.min(b.x),
            [a, b] => b.y < a.y && a.x == 0.0 && b.x == 0.0,
            _ => false,
        }
    }

    /// Returns the largest change of a cable's length within the box of these corners, full steps.
    pub(super) fn steps_across(&self, corners: &[Point3<f64>; 8]) -> f64 {
        let change = |motor: &Point3<f64>| {
            let lengths = corners.map(|corner| (corner - motor).norm());
            let longest = lengths.iter().copied().fold(0.0, f64::max);
            longest - lengths.iter().copied().fold(f64::INFINITY, f64::min)
        };
        self.motors.iter().map(change).fold(0.0, f64::max) / self.cable_per_step
    }
}
