//! Inverse kinematics by a model that is wrong, corrected by what the camera sees.

use nalgebra::{Point3, Vector3};
use plumb_core::law::{Law, Measurement, Setpoint};
use plumb_emulator::rig::{Geometry, RigError, Task};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::f64_reference::{Seen, along, setpoint};
use plumb_sim::limits::Limits;

/// Of what a picture says of the way that is left beyond what the model foretold, what is taken.
const GAIN: f64 = 0.35;

/// Stream of a task's random numbers that the model's errors are drawn from.
const MODEL_STREAM: u64 = 1 << 41;

/// A model of the rig, and the way that is left by it.
pub(in super::super) struct Model {
    limits: Limits,
    rig: Geometry,
    /// Steps to the target by the last picture, and where the motors were for it.
    left: Option<(Vector3<f64>, Vector3<f64>)>,
}

impl Model {
    /// The rig of `task` as someone measured it who was wrong by the part `wrong` one way or the
    /// other, drawn from `seed` and `index`: in each motor's distance along x, y and z from the
    /// middle of start and target, and in the pulleys' radius.
    ///
    /// # Errors
    /// Where no rig is like that.
    pub(in super::super) fn new(
        task: &Task,
        wrong: f64,
        limits: Limits,
        (seed, index): (u64, u64),
    ) -> Result<Self, RigError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(MODEL_STREAM | index);
        let mut factor = || if rng.random::<bool>() { 1.0 + wrong } else { 1.0 - wrong };
        let middle = nalgebra::center(&task.start, &task.target);
        let motors = task.geometry.motors().map(|motor: Point3<f64>| {
            let from = motor - middle;
            middle + from.component_mul(&Vector3::new(factor(), factor(), factor()))
        });
        let radius = factor();
        let rig = Geometry::new(motors, task.geometry.pulley_radii_m().map(|r| r * radius))?;
        Ok(Self { limits, rig, left: None })
    }

    /// Steps from one point to another (mm) by the model.
    fn steps(&self, from: Vector3<f64>, to: Vector3<f64>) -> Vector3<f64> {
        let lengths =
            |p: Vector3<f64>| Vector3::from(self.rig.cable_lengths_m(&Point3::from(p * 1e-3)));
        (lengths(to) - lengths(from)).component_div(&Vector3::from(self.rig.step_lengths_m()))
    }
}

impl Law for Model {
    fn update(&mut self, picture: &Measurement) -> Setpoint {
        let seen = Seen::from(picture);
        let by_sight = self.steps(seen.ball, seen.target);
        let foretold = self.left.map(|(left, motors)| left - (seen.then - motors));
        let left = foretold.map_or(by_sight, |left| left + (by_sight - left) * GAIN);
        self.left = Some((left, seen.then));
        setpoint(along(left - (seen.ahead - seen.then), &self.limits))
    }
}
