//! Inverse kinematics with an inaccurate model and camera feedback; with feed-forward for a target
//! that moves.

use nalgebra::{Point3, Vector3};
use plumb_core::law::{Law, Measurement, Setpoint};
use plumb_emulator::plant::{Geometry, RigError, Task};
use plumb_sim::limits::RigLimits;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::float::{FloatMeasurement, along, ramp_down, setpoint};
use crate::run_id::RunId;

/// Gain of the filter for the remaining steps: fraction of the innovation.
const GAIN: f64 = 0.35;

/// Stream of the random numbers that give the model's errors.
const MODEL_STREAM: u64 = 1 << 41;

/// State of the controller: an inaccurate model of the rig and the remaining steps.
pub(in super::super) struct Model {
    limits: RigLimits,
    rig: Geometry,
    /// State at the last frame.
    last: Option<Last>,
}

/// State of the filter at a frame.
struct Last {
    /// Remaining steps to the target.
    remaining: Vector3<f64>,
    /// Motor positions, steps.
    motors: Vector3<f64>,
    /// Target, mm.
    target: Vector3<f64>,
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
        limits: RigLimits,
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
        Ok(Self { limits, rig, last: None })
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
        let predicted = self.last.as_ref().map(|last| {
            let moved = self.steps(last.target, measurement.target);
            last.remaining + moved - (measurement.motors - last.motors)
        });
        let remaining = predicted.map_or(measured, |steps| steps + (measured - steps) * GAIN);
        let FloatMeasurement { motors, target, .. } = measurement;
        self.last = Some(Last { remaining, motors, target });
        // The model's steps over a millisecond of the target's movement.
        let ahead = target + measurement.velocity * 1e-3;
        let following = self.steps(target, ahead) * 1e3;
        let coming = measurement.motors_ahead - motors - ramp_down(following, &self.limits);
        setpoint(along(remaining - coming, &self.limits) + following)
    }
}
