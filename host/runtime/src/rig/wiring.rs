//! Wiring of a simulated rig: motors on the outputs of the board.

use serde::Deserialize;
use thiserror::Error;

/// Motor of a simulated rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum SimulatedMotor {
    /// Motor A.
    A,
    /// Motor B.
    B,
    /// Motor C.
    C,
}

/// Simulated motors on the outputs A, B, C of the board. Each motor is on one output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "[SimulatedMotor; 3]")]
pub struct Wiring([SimulatedMotor; 3]);

/// Wiring with one motor on two outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("one motor is on two outputs of the board; A, B and C must each be there once")]
pub struct WiringError;

impl Wiring {
    /// Returns the number (A 0, B 1, C 2) of the motor on each output of the board.
    pub fn motors(&self) -> [usize; 3] {
        self.0.map(|motor| motor as usize)
    }
}

impl Default for Wiring {
    /// Returns each motor on its own output.
    fn default() -> Self {
        Self([SimulatedMotor::A, SimulatedMotor::B, SimulatedMotor::C])
    }
}

impl TryFrom<[SimulatedMotor; 3]> for Wiring {
    type Error = WiringError;

    fn try_from(motors: [SimulatedMotor; 3]) -> Result<Self, WiringError> {
        let [a, b, c] = motors;
        if a == b || b == c || c == a { Err(WiringError) } else { Ok(Self(motors)) }
    }
}
