//! The board behind two motors.

use nalgebra::Point3;

use super::{Object, Pattern, Room, Shape};
use crate::synthetic::light::Material;

/// Distance of the board from the plane of the cables, metres.
const BEHIND: f64 = 0.12;

/// Half of the board's thickness, metres.
const HALF_THICKNESS: f64 = 0.01;

/// From the middle between the motors to the board's sides, and from the motors to its lower edge,
/// in distances of the motors.
const HALF_WIDTH: f64 = 0.75;
const DEPTH: f64 = 1.1;

/// From the motors to the board's upper edge, metres.
const ABOVE: f64 = 0.1;

impl Room {
    /// Returns the room with an upright white board behind the motors `a` and `b` of a rig of two
    /// cables, as seen from `eye` (metres, rig frame).
    pub fn with_board(self, [a, b]: [Point3<f64>; 2], eye: Point3<f64>) -> Self {
        let along = (b - a).xy();
        let distance = along.norm();
        let yaw = (-along.x).atan2(along.y);
        let normal = nalgebra::Vector3::new(yaw.cos(), yaw.sin(), 0.0);
        let middle = nalgebra::center(&a, &b);
        let behind = -BEHIND * normal.dot(&(eye - middle)).signum() * normal;
        let (top, bottom) = (middle.z + ABOVE, middle.z - DEPTH * distance);
        let centre = Point3::new(middle.x, middle.y, (top + bottom) / 2.0) + behind;
        let half = [HALF_THICKNESS, HALF_WIDTH * distance, (top - bottom) / 2.0];
        let board = Shape::Block { centre, half: half.into(), yaw };
        let white = Material::from_srgb(232, 230, 222).matt();
        self.with(Object::new(board, white).with_pattern(Pattern::Mottled))
    }
}
