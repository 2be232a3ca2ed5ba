//! Explanations of what the ball does: wirings of the motors, and orientations of the frame. The
//! misfit of an explanation measures how well it fits the measured directions.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};
use plumb_runtime::rig::Size;

use super::fault::{Fault, Output};

/// Step between the turns of the frame that are tried, degrees.
const YAW_STEP_DEG: u16 = 15;

/// Motors on the outputs of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wiring {
    /// Motor on each output: A 0, B 1, C 2.
    pub motors: [usize; 3],
    /// Whether the motor on each output turns the wrong way.
    pub reversed: [bool; 3],
}

impl Wiring {
    /// Right wiring.
    pub const RIGHT: Self = Self { motors: [0, 1, 2], reversed: [false; 3] };

    /// Returns every wiring.
    pub fn all() -> impl Iterator<Item = Self> {
        const ORDERS: [[usize; 3]; 6] =
            [[0, 1, 2], [1, 0, 2], [2, 1, 0], [0, 2, 1], [1, 2, 0], [2, 0, 1]];
        let directions = |bits: u8| [0, 1, 2].map(|output| bits >> output & 1 == 1);
        ORDERS.into_iter().flat_map(move |motors| {
            (0..8).map(move |bits| Self { motors, reversed: directions(bits) })
        })
    }

    /// Returns the number of mistakes: exchanges of two plugs, and reversed motors. Three reversed
    /// motors count as two: one habit explains them.
    fn mistakes(&self) -> u32 {
        let displaced = (0..3).filter(|&output| self.motors[output] != output).count() as u32;
        let reversed = self.reversed.iter().filter(|&&reversed| reversed).count() as u32;
        displaced.saturating_sub(1) + reversed.min(2)
    }

    fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let displaced: Vec<usize> = (0..3).filter(|&k| self.motors[k] != k).collect();
        match displaced[..] {
            [first, second] => {
                faults.push(Fault::Swapped(Output::ALL[first], Output::ALL[second]));
            }
            [_, _, _] => faults.push(Fault::Rotated(self.motors.map(|motor| Output::ALL[motor]))),
            _ => {}
        }
        let reversed = (0..3).filter(|&k| self.reversed[k]);
        faults.extend(reversed.map(|k| Fault::Reversed(Output::ALL[k])));
        faults
    }
}

/// Orientation of the frame of the measured positions in the rig frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    /// Turn about the vertical, degrees counter-clockwise as seen from above, 0 to 359.
    pub yaw_deg: u16,
    /// Whether left and right are exchanged.
    pub mirrored: bool,
    /// Whether up and down are exchanged, as with a camera that hangs upside down.
    pub inverted: bool,
}

impl Frame {
    /// The rig frame itself.
    pub const RIGHT: Self = Self { yaw_deg: 0, mirrored: false, inverted: false };

    /// Returns every frame with this handedness and this vertical, in steps of 15 degrees.
    pub fn turned(mirrored: bool, inverted: bool) -> impl Iterator<Item = Self> {
        (0..360 / YAW_STEP_DEG).map(move |k| Self { yaw_deg: k * YAW_STEP_DEG, mirrored, inverted })
    }

    /// Returns the matrix from the rig frame to the frame of the positions: orthogonal.
    pub fn matrix(&self) -> Matrix3<f64> {
        let sign = |negative| if negative { -1.0 } else { 1.0 };
        // Upside down is a rotation by 180 degrees about x.
        let diagonal = Vector3::new(1.0, sign(self.mirrored != self.inverted), sign(self.inverted));
        let yaw = f64::from(self.yaw_deg) * PI / 180.0;
        Rotation3::from_axis_angle(&Vector3::z_axis(), yaw) * Matrix3::from_diagonal(&diagonal)
    }

    fn mistakes(&self) -> u32 {
        u32::from(self.yaw_deg != 0) + u32::from(self.mirrored) + u32::from(self.inverted)
    }

    fn faults(&self) -> Vec<Fault> {
        let turned = (self.yaw_deg != 0).then_some(Fault::Turned { degrees: self.yaw_deg });
        let mirrored = self.mirrored.then_some(Fault::Mirrored);
        let inverted = self.inverted.then_some(Fault::UpsideDown);
        inverted.into_iter().chain(mirrored).chain(turned).collect()
    }
}

/// Explanation of the measured directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Explanation {
    /// Wiring of the motors.
    pub wiring: Wiring,
    /// Frame of the positions.
    pub frame: Frame,
}

/// Extra cost of a wrong frame where the ball is seen inside the workspace: with another pose it
/// would be seen elsewhere.
const SEEN_INSIDE: u32 = 2;

/// Extra cost of the right frame where the ball is seen outside the workspace.
const SEEN_OUTSIDE: u32 = 1;

impl Explanation {
    /// Returns the faults, one after the other; none for a right rig.
    pub fn faults(&self) -> Vec<Fault> {
        [self.wiring.faults(), self.frame.faults()].concat()
    }

    /// Returns how far-fetched the explanation is: the number of mistakes, and more where it
    /// disagrees with the place of the ball.
    pub fn cost(&self, is_inside: bool) -> u32 {
        let is_frame_right = self.frame == Frame::RIGHT;
        let place = match (is_frame_right, is_inside) {
            (false, true) => SEEN_INSIDE,
            (true, false) => SEEN_OUTSIDE,
            _ => 0,
        };
        self.wiring.mistakes() + self.frame.mistakes() + place
    }
}

/// Response of the ball to one output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Column {
    /// Number of the output.
    pub output: usize,
    /// Displacement for a step that is to pay out, metres.
    pub per_step: Vector3<f64>,
    /// Standard deviation along one axis, metres.
    pub sd: f64,
}

/// Standard deviation of a direction apart from the camera's noise, as a sine: 7 degrees. It covers
/// the pose, the size by tape measure, and the curvature of the path.
const DIRECTION_SD: f64 = 0.122;

/// Standard deviation of the slope of a path, as a sine: 3 degrees. It covers a tilted pose.
const SLOPE_SD: f64 = 0.052;

/// Largest misfit of an explanation that is accepted, variances: three standard deviations in each
/// of three directions.
pub(super) const ACCEPTED: f64 = 27.0;

/// Returns the misfit of `explanation` in variances: 0 where every direction is possible.
pub(super) fn misfit(explanation: &Explanation, columns: &[Column], sectors: &Sectors) -> f64 {
    columns.iter().map(|column| column_misfit(explanation, column, sectors)).sum()
}

fn column_misfit(explanation: &Explanation, column: &Column, sectors: &Sectors) -> f64 {
    let moved = in_rig_frame(explanation, column);
    let sector = sectors.0[explanation.wiring.motors[column.output]];
    let horizontal = moved.xy().norm();
    let excess = sector.excess(moved.y.atan2(moved.x)).abs();
    let aside = if excess < std::f64::consts::FRAC_PI_2 { excess.sin() } else { 1.0 };
    let variances = |distance: f64, sine: f64| {
        distance.powi(2) / (column.sd.powi(2) + (sine * moved.norm()).powi(2))
    };
    variances(horizontal * aside, DIRECTION_SD) + variances(moved.z.max(0.0), SLOPE_SD)
}

/// Returns the mean turn about the vertical, radians, that the columns have beyond `explanation`.
pub(super) fn remaining_yaw(
    explanation: &Explanation,
    columns: &[Column],
    sectors: &Sectors,
) -> f64 {
    let excess = columns.iter().map(|column| {
        let moved = in_rig_frame(explanation, column);
        let sector = sectors.0[explanation.wiring.motors[column.output]];
        sector.excess(moved.y.atan2(moved.x))
    });
    let handedness = explanation.frame.matrix().fixed_view::<2, 2>(0, 0).determinant();
    handedness * excess.sum::<f64>() / columns.len().max(1) as f64
}

/// Returns the displacement of `column` for cable that is paid out, in the rig frame.
fn in_rig_frame(explanation: &Explanation, column: &Column) -> Vector3<f64> {
    let sign = if explanation.wiring.reversed[column.output] { -1.0 } else { 1.0 };
    explanation.frame.matrix().transpose() * column.per_step * sign
}

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
