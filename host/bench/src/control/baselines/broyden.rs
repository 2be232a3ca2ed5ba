//! Uncalibrated visual servoing: Broyden's rank-one updates of J, damped Gauss-Newton steps
//! (Jägersand, Fuentes and Nelson, "Experimental evaluation of uncalibrated visual servoing for
//! precision manipulation", ICRA 1997).

use std::collections::VecDeque;

use nalgebra::{Matrix3, Vector3};
use plumb_core::law::{Law, Measurement, Setpoint};
use plumb_protocol::config::SIGNS;

use super::super::f64_reference::{Seen, along, setpoint};
use plumb_sim::limits::Limits;

/// First guess of |J|, mm/step: the one in docs/understand/method.md.
const GUESS: f64 = 0.188;
/// An update compares the ball with where it was so many pictures ago.
const SPAN: usize = 3;
/// Of a rank-one update, what is taken; all of it where the motors turned by much more than
/// [`QUIET`] steps meanwhile.
const TRUST: f64 = 0.5;
const QUIET: f64 = 20.0;
/// Damping of the Gauss-Newton step, of the largest entry of J.
const DAMPING: f64 = 0.5;
/// Of what a picture says of the position beyond what J foretold, what is taken.
const POSITION_GAIN: f64 = 0.35;

/// J, a filtered position, and the last pictures.
pub(in super::super) struct Broyden {
    limits: Limits,
    j: Matrix3<f64>,
    /// The ball (mm) and the motors (steps) by the last pictures.
    past: VecDeque<(Vector3<f64>, Vector3<f64>)>,
    /// The filtered position, mm.
    position: Option<Vector3<f64>>,
}

impl Broyden {
    /// Nothing known but Σ, on motors of these limits.
    pub(in super::super) fn new(limits: Limits) -> Self {
        let j = Matrix3::from_fn(|i, k| GUESS * f64::from(SIGNS[i][k]));
        Self { limits, j, past: VecDeque::new(), position: None }
    }

    /// J += η (Δp - J Δn) Δn'/|Δn|².
    fn learn(&mut self, seen: &Seen) {
        if let Some((ball, motors)) = self.past.front() {
            let (moved, turned) = (seen.ball - ball, seen.then - motors);
            let missed = moved - self.j * turned;
            self.j +=
                missed * turned.transpose() * (TRUST / (turned.norm_squared() + QUIET * QUIET));
        }
        self.past.push_back((seen.ball, seen.then));
        if self.past.len() > SPAN {
            self.past.pop_front();
        }
    }

    /// Where the ball was in the picture, by what was seen and by how the motors turned since the
    /// last one, mm.
    fn located(&mut self, seen: &Seen) -> Vector3<f64> {
        let last = self.past.back().map(|(_, motors)| *motors);
        let foretold = self.position.zip(last).map(|(p, motors)| p + self.j * (seen.then - motors));
        let position = foretold.map_or(seen.ball, |p| p + (seen.ball - p) * POSITION_GAIN);
        *self.position.insert(position)
    }
}

impl Law for Broyden {
    fn update(&mut self, picture: &Measurement) -> Setpoint {
        let seen = Seen::from(picture);
        let position = self.located(&seen);
        self.learn(&seen);
        let e = seen.target - (position + self.j * (seen.ahead - seen.then));
        let damping = Matrix3::identity() * (DAMPING * self.j.amax()).powi(2);
        // Levenberg: (J'J + μ²) n = J'e, positive definite.
        let normal = self.j.transpose() * self.j + damping;
        let steps = normal.cholesky().map(|c| c.solve(&(self.j.transpose() * e)));
        setpoint(along(steps.unwrap_or_default(), &self.limits))
    }
}
