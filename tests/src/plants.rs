//! Rigs that a law is proved for, and rigs that are put together wrongly.

use nalgebra::{Matrix3, Point3, Vector3};
use plumb_emulator::rig::{Plant, RigError};

/// A ball that moves by a constant Jacobian: any member of an interval family, which no real rig
/// need be.
pub struct Linear {
    /// dp/du, metres of ball a metre of cable.
    pub jacobian: Matrix3<f64>,
    /// Metres of cable a full step.
    pub step: f64,
    /// Where the ball is with the motors at zero, metres.
    pub start: Point3<f64>,
    motors: Vector3<f64>,
}

impl Linear {
    /// With the motors at zero.
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

/// A rig whose motors are plugged in wrongly.
pub struct Miswired<P> {
    /// The rig.
    pub plant: P,
    /// BenchLaw of the board's motors turns pulley A, B, C.
    pub order: [usize; 3],
    /// +1, or -1 for a reversed motor; by pulley.
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
