//! Horizontal directions in which the ball moves when a cable is paid out.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector2;

use crate::rig::Size;

/// Smallest and largest angle of the motors' triangle at A and B where its size is unknown,
/// radians: 15 and 90 degrees. Σ holds for acute angles.
const UNKNOWN_ANGLE: [f64; 2] = [PI / 12.0, FRAC_PI_2];

/// Uncertainty of an angle from lengths by tape measure, radians: 4 degrees.
const TAPE: f64 = PI / 45.0;

/// Range of horizontal directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sector {
    /// Direction of the middle, radians from +x towards +y.
    pub middle: f64,
    /// Half of the width, radians.
    pub half_width: f64,
}

impl Sector {
    fn between(low: f64, high: f64) -> Self {
        Self { middle: (low + high) / 2.0, half_width: (high - low) / 2.0 }
    }

    /// Returns the angle from the nearest direction of the sector to `direction`, radians, -π to
    /// π; 0 inside the sector.
    pub fn excess(&self, direction: f64) -> f64 {
        let turn = direction - self.middle;
        let turn = turn.sin().atan2(turn.cos());
        turn.signum() * (turn.abs() - self.half_width).max(0.0)
    }
}

/// Directions of the ball for motors A, B, C.
///
/// With the other two cables at their lengths, the ball moves on a circle about the line through
/// the other two motors, and so at right angles to that line, wherever it hangs. C moves it along
/// +x. A moves it from -x towards -y by the triangle's angle at B, and B towards +y by the angle
/// at A.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sectors(pub [Sector; 3]);

impl Sectors {
    /// Returns the sectors of a triangle of unknown shape: all that Σ says.
    pub fn unknown() -> Self {
        let [low, high] = UNKNOWN_ANGLE;
        Self([
            Sector::between(PI + low, PI + high),
            Sector::between(PI - high, PI - low),
            Sector { middle: 0.0, half_width: 0.0 },
        ])
    }

    /// Returns the sectors of a rig of this size.
    pub fn of(size: &Size) -> Self {
        let points = size.motors().map(|motor| motor.xy().coords);
        Self([0, 1, 2].map(|motor| {
            let [this, next, last] = [0, 1, 2].map(|k| points[(motor + k) % 3]);
            let away = across(next, last, this);
            Sector { middle: away.y.atan2(away.x), half_width: TAPE }
        }))
    }
}

/// Returns a vector at right angles to the line through `from` and `to`, on the other side than
/// `point`.
fn across(from: Vector2<f64>, to: Vector2<f64>, point: Vector2<f64>) -> Vector2<f64> {
    let line = to - from;
    let normal = Vector2::new(-line.y, line.x);
    if normal.dot(&(point - from)) > 0.0 { -normal } else { normal }
}
