//! Inverse kinematics with an inaccurate model and camera feedback; with feed-forward for a target
//! that moves.

use nalgebra::{Point3, Vector3};
use plumb_core::law::{Law, Measurement, Setpoint};
use plumb_emulator::plant::{Geometry, RigError, Task};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::f64_reference::{FloatMeasurement, along, setpoint};
use super::super::suite::RunId;
use plumb_sim::limits::Limits;

/// Gain of the filter for the remaining steps: fraction of the innovation.
const GAIN: f64 = 0.35;

/// Stream of the random numbers that give the model's errors.
const MODEL_STREAM: u64 = 1 << 41;

/// State of the controller: an inaccurate model of the rig and the remaining steps.
pub(in super::super) struct Model {
    limits: Limits,
    rig: Geometry,
    /// Remaining steps to the target at the last frame, and the motor positions (steps) then.
    remaining: Option<(Vector3<f64>, Vector3<f64>)>,
}

impl Model {
    /// Creates a controller whose model has a relative error of ±`error` in each motor's distance
    /// along x, y and z from the middle of start and target, and in the pulleys' radius. The signs
    /// are random.
    ///
    /// # Errors
    /// If the model describes no valid rig.
    pub(in super::super) fn new(
        task: &Task,
        error: f64,
        limits: Limits,
        id: RunId,
    ) -> Result<Self, RigError> {
        let mut rng = ChaCha8Rng::seed_from_u64(id.seed);
        rng.set_stream(MODEL_STREAM | id.rig);
        let mut factor = || if rng.random::<bool>() { 1.0 + error } else { 1.0 - error };
        let middle = nalgebra::center(&task.start, &task.target);
        let motors = task.geometry.motors().map(|motor: Point3<f64>| {
            let from = motor - middle;
            middle + from.component_mul(&Vector3::new(factor(), factor(), factor()))
        });
        let radius = factor();
        let rig = Geometry::new(motors, task.geometry.pulley_radii_m().map(|r| r * radius))?;
        Ok(Self { limits, rig, remaining: None })
    }

    /// Returns the model's steps from one point to another (mm).
    fn steps(&self, from: Vector3<f64>, to: Vector3<f64>) -> Vector3<f64> {
        let lengths =
            |p: Vector3<f64>| Vector3::from(self.rig.cable_lengths_m(&Point3::from(p * 1e-3)));
        (lengths(to) - lengths(from)).component_div(&Vector3::from(self.rig.step_lengths_m()))
    }
}

impl Law for Model {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        let measurement = FloatMeasurement::from(measurement);
        let measured = self.steps(measurement.ball, measurement.target);
        let predicted = self.remaining.map(|(steps, motors)| steps - (measurement.motors - motors));
        let remaining = predicted.map_or(measured, |steps| steps + (measured - steps) * GAIN);
        self.remaining = Some((remaining, measurement.motors));
        let correction =
            along(remaining - (measurement.motors_ahead - measurement.motors), &self.limits);
        // The model's steps over a millisecond of the target's movement.
        let ahead = measurement.target + measurement.velocity * 1e-3;
        setpoint(correction + self.steps(measurement.target, ahead) * 1e3)
    }
}
