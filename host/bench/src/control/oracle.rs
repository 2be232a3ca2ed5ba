//! The oracle: a robot with a perfect model that moves all motors synchronised, as fast as their
//! limits allow.

use plumb_emulator::plant::{RigError, Task, lowest_point};
use plumb_protocol::PerMotor;
use plumb_sim::limits::RigLimits;

/// Time resolution, seconds.
pub(super) const STEP_S: f64 = 1e-3;

/// A straight path from start to target in the space of cable lengths.
pub(super) struct Path {
    /// Cable lengths at the start, metres.
    start_m: PerMotor<f64>,
    /// Steps of each motor from start to target.
    pub(super) steps: PerMotor<f64>,
    /// Cable length of a step of each motor, metres.
    pub(super) step_m: PerMotor<f64>,
}

impl Path {
    /// Creates the path of a task.
    pub(super) fn new(task: &Task) -> Self {
        let (start_m, end) = (
            task.geometry.cable_lengths_m(&task.start),
            task.geometry.cable_lengths_m(&task.target),
        );
        let step_m = task.geometry.step_lengths_m();
        Self { start_m, steps: std::array::from_fn(|i| (end[i] - start_m[i]) / step_m[i]), step_m }
    }

    /// Returns the greatest number of steps of a motor.
    pub(super) fn longest(&self) -> f64 {
        self.steps.iter().fold(0.0, |most, s| s.abs().max(most))
    }

    /// Returns the cable lengths (metres) at a fraction of the path, 0 to 1.
    pub(super) fn lengths(&self, fraction: f64) -> PerMotor<f64> {
        std::array::from_fn(|i| self.start_m[i] + fraction * self.steps[i] * self.step_m[i])
    }
}

/// Returns the fraction of a path of `length` steps that a trapezoidal rate profile has covered
/// after `t` seconds.
fn trapezoid(length: f64, limits: &RigLimits, t: f64) -> f64 {
    let ramp = limits.rate / limits.acceleration;
    let (ramp, top) = if length >= limits.rate * ramp {
        (ramp, limits.rate)
    } else {
        let short = (length / limits.acceleration).sqrt();
        (short, short * limits.acceleration)
    };
    let end = length / top + ramp;
    let covered = if t >= end {
        length
    } else if t > end - ramp {
        length - 0.5 * limits.acceleration * (end - t).powi(2)
    } else if t > ramp {
        top * (t - 0.5 * ramp)
    } else {
        0.5 * limits.acceleration * t * t
    };
    covered / length
}

/// Returns the oracle's time to within `threshold_m` of the target on rigid cables, seconds.
///
/// # Errors
/// If the rig cannot hold its ball somewhere on the path.
pub(crate) fn time_s(task: &Task, limits: &RigLimits, threshold_m: f64) -> Result<f64, RigError> {
    let path = Path::new(task);
    let length = path.longest();
    let mut t = 0.0;
    loop {
        let fraction = if length > 0.0 { trapezoid(length, limits, t) } else { 1.0 };
        let ball = lowest_point(&task.geometry, path.lengths(fraction))?.ball;
        if (ball - task.target).norm() <= threshold_m || fraction >= 1.0 {
            return Ok(t.max(STEP_S));
        }
        t += STEP_S;
    }
}

/// Returns the oracle's plan: motor positions in full steps, one row a millisecond.
pub(crate) fn trapezoids(task: &Task, limits: &RigLimits) -> Vec<PerMotor<f64>> {
    let path = Path::new(task);
    let length = path.longest();
    let fractions = (0u32..).map(|k| match length {
        0.0 => 1.0,
        _ => trapezoid(length, limits, f64::from(k) * STEP_S),
    });
    let mut rows: Vec<_> =
        fractions.take_while(|f| *f < 1.0).map(|f| path.steps.map(|s| s * f)).collect();
    rows.push(path.steps);
    rows
}
