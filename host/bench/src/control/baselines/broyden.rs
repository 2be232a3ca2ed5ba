//! Uncalibrated visual servoing: Broyden's rank-one updates of J, damped Gauss-Newton steps
//! (Jägersand, Fuentes and Nelson, "Experimental evaluation of uncalibrated visual servoing for
//! precision manipulation", ICRA 1997).

use std::collections::VecDeque;

use nalgebra::{Matrix3, Vector3};
use plumb_core::law::{Law, Measurement, Setpoint};
use plumb_protocol::config::SIGNS;
use plumb_sim::limits::RigLimits;

use super::super::float::{FloatMeasurement, along, ramp_down, setpoint};

/// Initial |J|, mm/step, from docs/understand/method.md.
const INITIAL_J: f64 = 0.188;
/// Number of frames between the two positions of an update.
const SPAN: usize = 3;
/// Gain of a rank-one update, for motions much longer than [`REGULARISATION`].
const UPDATE_GAIN: f64 = 0.5;
/// Motor motion at which the gain of an update is halved, steps.
const REGULARISATION: f64 = 20.0;
/// Damping of the Gauss-Newton step, as a multiple of the largest entry of J.
const DAMPING: f64 = 0.5;
/// Gain of the position filter: fraction of the innovation.
const POSITION_GAIN: f64 = 0.35;

/// State of the controller: J, a filtered position, and the last frames.
pub(in super::super) struct Broyden {
    limits: RigLimits,
    /// Estimate of J, mm/step.
    j: Matrix3<f64>,
    /// Ball (mm) and motors (steps) of the last frames, oldest first.
    past: VecDeque<(Vector3<f64>, Vector3<f64>)>,
    /// The filtered position, mm.
    position: Option<Vector3<f64>>,
}

impl Broyden {
    /// Creates the controller with an initial J from the signs Σ, for motors of these limits.
    pub(in super::super) fn new(limits: RigLimits) -> Self {
        let j = Matrix3::from_fn(|i, k| INITIAL_J * f64::from(SIGNS[i][k]));
        Self { limits, j, past: VecDeque::new(), position: None }
    }

    /// Updates J: J += η (Δp - J Δn) Δn'/(|Δn|² + r²).
    fn update_jacobian(&mut self, measurement: &FloatMeasurement) {
        if let Some((ball, motors)) = self.past.front() {
            let (moved, turned) = (measurement.ball - ball, measurement.motors - motors);
            let residual = moved - self.j * turned;
            self.j += residual
                * turned.transpose()
                * (UPDATE_GAIN / (turned.norm_squared() + REGULARISATION * REGULARISATION));
        }
        self.past.push_back((measurement.ball, measurement.motors));
        if self.past.len() > SPAN {
            self.past.pop_front();
        }
    }

    /// Returns the filtered position of the ball in the frame, mm. The prediction comes from the
    /// motors' motion since the last frame.
    fn filter_position(&mut self, measurement: &FloatMeasurement) -> Vector3<f64> {
        let last = self.past.back().map(|(_, motors)| *motors);
        let predicted =
            self.position.zip(last).map(|(p, motors)| p + self.j * (measurement.motors - motors));
        let position =
            predicted.map_or(measurement.ball, |p| p + (measurement.ball - p) * POSITION_GAIN);
        *self.position.insert(position)
    }
}

impl Law for Broyden {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        let measurement = FloatMeasurement::from(measurement);
        let position = self.filter_position(&measurement);
        self.update_jacobian(&measurement);
        let damping = Matrix3::identity() * (DAMPING * self.j.amax()).powi(2);
        // Levenberg: (J'J + μ²) n = J'e, positive definite.
        let normal = self.j.transpose() * self.j + damping;
        let Some(normal) = normal.cholesky() else { return Setpoint::default() };
        let steps = |e| normal.solve(&(self.j.transpose() * e));
        // A target that moves is fed forward by the same J.
        let following = steps(measurement.velocity);
        let coming =
            measurement.motors_ahead - measurement.motors - ramp_down(following, &self.limits);
        let e = measurement.target - (position + self.j * coming);
        setpoint(along(steps(e), &self.limits) + following)
    }
}
