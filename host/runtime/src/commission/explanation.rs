//! Explanations of what the ball does: wirings of the motors, and orientations of the frame.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Rotation3, Vector3};

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

    /// Returns whether all motors are on their own outputs.
    pub fn is_in_order(&self) -> bool {
        self.motors == Self::RIGHT.motors
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
