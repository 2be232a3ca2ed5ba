//! The paper's law: eqs. (7) and (8) in explicit form.

use plumb_core::law::{Law, Measurement, Setpoint};

use super::{Seen, setpoint};
use plumb_runtime::rig::NOMINAL_STEP_M;

/// u̇ = -γ v; v_k is what of column k's interval of e'J is nearest to zero.
pub(super) struct Interval {
    /// Steps/s for a millimetre of v.
    gain: f64,
    /// Least and greatest value of each entry of J.
    bounds: [[(f64, f64); 3]; 3],
}

impl Interval {
    /// γ in 1/s for a cable of [`NOMINAL_STEP_M`] a step; α, β; Σ by rows.
    pub(super) fn new(gamma: f64, (alpha, beta): (f64, f64), signs: &[[i8; 3]; 3]) -> Self {
        let entry = |sign: i8| match sign {
            0 => (0.0, 0.0),
            1.. => (alpha, beta),
            _ => (-beta, -alpha),
        };
        Self { gain: gamma * 1e-3 / NOMINAL_STEP_M, bounds: signs.map(|row| row.map(entry)) }
    }
}

impl Law for Interval {
    fn update(&mut self, picture: &Measurement) -> Setpoint {
        let seen = Seen::from(picture);
        let e = seen.ball - seen.target;
        let v = [0, 1, 2].map(|k| {
            let (mut eta, mut mu) = (0.0, 0.0);
            for i in 0..3 {
                let (lower, upper) = self.bounds[i][k];
                eta += (e[i] * lower).min(e[i] * upper);
                mu += (e[i] * lower).max(e[i] * upper);
            }
            f64::max(eta, 0.0) + f64::min(mu, 0.0)
        });
        setpoint(v.map(|v| -self.gain * v).into())
    }
}
