//! The paper's law: eqs. (7) and (8) in explicit form.

use plumb_core::law::{Law, Measurement, Setpoint};
use plumb_protocol::{AXES, PerAxis, PerMotor};

use crate::control::float::{FloatMeasurement, setpoint};
use plumb_runtime::rig::NOMINAL_STEP_M;

/// Law u̇ = -γ v, where v_k is the point nearest to zero in column k's interval of e'J.
pub(super) struct Interval {
    /// Gain, steps/s for a millimetre of v.
    gain: f64,
    /// Bounds of each entry of J, dimensionless.
    bounds: PerAxis<PerMotor<(f64, f64)>>,
}

impl Interval {
    /// Creates the law from γ (1/s for a cable of [`NOMINAL_STEP_M`] a step), α, β and the rows
    /// of Σ.
    pub(super) fn new(
        gamma: f64,
        (alpha, beta): (f64, f64),
        signs: &PerAxis<PerMotor<i8>>,
    ) -> Self {
        let entry = |sign: i8| match sign {
            0 => (0.0, 0.0),
            1.. => (alpha, beta),
            _ => (-beta, -alpha),
        };
        Self { gain: gamma * 1e-3 / NOMINAL_STEP_M, bounds: signs.map(|row| row.map(entry)) }
    }
}

impl Law for Interval {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        let measurement = FloatMeasurement::from(measurement);
        let e = measurement.ball - measurement.target;
        let v: PerMotor<f64> = std::array::from_fn(|k| {
            let (mut eta, mut mu) = (0.0, 0.0);
            for i in 0..AXES {
                let (lower, upper) = self.bounds[i][k];
                eta += (e[i] * lower).min(e[i] * upper);
                mu += (e[i] * lower).max(e[i] * upper);
            }
            f64::max(eta, 0.0) + f64::min(mu, 0.0)
        });
        setpoint(v.map(|v| -self.gain * v).into())
    }
}
