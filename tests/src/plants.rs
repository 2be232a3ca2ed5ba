//! Plants with a constant Jacobian, and plants with wiring faults.

use nalgebra::{Matrix3, Point3, Vector3};
use plumb_emulator::plant::{Plant, RigError};

/// A plant with a constant Jacobian: any member of an interval family.
pub struct Linear {
    /// dp/du, metres of ball per metre of cable.
    pub jacobian: Matrix3<f64>,
    /// Cable per full step, m.
    pub step: f64,
    /// Position of the ball with the motors at zero, m.
    pub start: Point3<f64>,
    motors: Vector3<f64>,
}

impl Linear {
    /// Returns the plant with the motors at zero.
    pub fn new(jacobian: Matrix3<f64>, step: f64, start: Point3<f64>) -> Self {
        Self { jacobian, step, start, motors: Vector3::zeros() }
    }
}

impl Plant for Linear {
    fn advance(&mut self, _dt_s: f64, motors: [f64; 3]) -> Result<(), RigError> {
        self.motors = Vector3::from(motors);
        Ok(())
    }

    fn ball(&self) -> Point3<f64> {
        self.start + self.jacobian * self.motors * self.step
    }

    fn slack(&self) -> [bool; 3] {
        [false; 3]
    }
}

/// A plant whose motors are connected in the wrong order or direction.
pub struct Miswired<P> {
    /// The plant with correct wiring.
    pub plant: P,
    /// Index of the board's motor that turns pulley A, B, C.
    pub order: [usize; 3],
    /// +1, or -1 for a reversed motor, for pulley A, B, C.
    pub signs: [f64; 3],
}

impl<P: Plant> Plant for Miswired<P> {
    fn advance(&mut self, dt_s: f64, motors: [f64; 3]) -> Result<(), RigError> {
        self.plant.advance(dt_s, [0, 1, 2].map(|i| self.signs[i] * motors[self.order[i]]))
    }

    fn ball(&self) -> Point3<f64> {
        self.plant.ball()
    }

    fn slack(&self) -> [bool; 3] {
        self.plant.slack()
    }
}
