//! Extended Kalman filter over the ball, the motors' positions, the cable of a step and the delay
//! of the measurements.

mod correction;
mod limits;
mod prediction;

use super::cables::Cables;
use super::geometry::{Matrix, Vector, along, dot, length, scaled};
use super::observation::Observation;
use super::prior::{DELAY, Guess, N};

/// Lag of the ball on its springs over its acceleration, squares of a frame time: 2 of them are
/// 0.002 s², 22 rad/s, between a stiff rig and a soft one.
const SPRING_LAG: f32 = 2.0;

/// One filter of the [multi-model filter](super::multi_model).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Filter {
    /// State; [`super::prior`] lists its entries.
    x: [f32; N],
    /// Covariance of the state.
    p: [[f32; N]; N],
    /// Cables at x after the last measurement.
    cables: Cables,
    /// Variances of the last measurement, mm².
    variances: Vector,
    /// Motor positions at the last measurement, steps.
    motors: Vector,
    /// Movement of the ball in the frame time before the last measurement, mm.
    moved: Vector,
    /// Twice the negative log-likelihood of the measurements, with `SCORE_MEMORY`.
    score: f32,
    /// Mean of the normalised innovations, with `BIAS_MEMORY`.
    bias: Vector,
    /// Outliers in a row.
    outliers: u8,
}

/// Returns the position of the ball that the cable lengths give. On springs the ball lags behind
/// that while it accelerates.
fn without_lag(seen: &Observation, cables: &Cables) -> Vector {
    let lag = along(&cables.j, scaled(seen.faster, SPRING_LAG * cables.step));
    // Not in z: the weight keeps the springs stretched.
    [seen.ball[0] + lag[0], seen.ball[1] + lag[1], seen.ball[2]]
}

impl Filter {
    /// Creates the filter at the first measurement, on the way to `target` (mm).
    pub(super) fn new(seen: &Observation, target: Vector, guess: &Guess) -> Self {
        let Observation { ball, variances, motors, .. } = *seen;
        let (x, p) = guess.prior(ball, variances, target);
        Self {
            x,
            p,
            cables: Cables::new(&x),
            variances,
            motors,
            moved: [0.0; 3],
            score: 0.0,
            bias: [0.0; 3],
            outliers: 0,
        }
    }

    /// Returns the filter as at the first measurement, with this score.
    pub(super) fn restarted(seen: &Observation, target: Vector, guess: &Guess, score: f32) -> Self {
        Self { score, ..Self::new(seen, target, guess) }
    }

    /// Returns the position of the ball, mm.
    pub(super) fn ball(&self) -> Vector {
        [self.x[0], self.x[1], self.x[2]]
    }

    /// Returns twice the negative log-likelihood of the measurements: less is better.
    pub(super) fn score(&self) -> f32 {
        self.score
    }

    /// Returns the cable of a step, mm.
    pub(super) fn step(&self) -> f32 {
        self.cables.step
    }

    /// Returns J, mm/step.
    pub(super) fn jacobian(&self) -> Matrix {
        let Cables { j, step, .. } = self.cables;
        j.map(|row| row.map(|j| step * j))
    }

    /// Returns the motor steps from the ball's position to `point` (mm), by the lengths of the
    /// cables: J is not constant, and near the motors it doubles within a few centimetres.
    pub(super) fn steps_to(&self, point: Vector) -> Vector {
        let Cables { lengths, step, .. } = self.cables;
        [0, 1, 2].map(|k| {
            let then = length([0, 1, 2].map(|i| point[i] - self.x[3 + 3 * k + i]));
            (then - lengths[k]) / step
        })
    }

    /// Returns the mean height of the motors above the ball, mm.
    pub(super) fn height(&self) -> f32 {
        (self.x[5] + self.x[8] + self.x[11]) / 3.0 - self.x[2]
    }

    /// Returns whether the state is finite and the variances positive: rounding may break a filter
    /// of very small variances.
    pub(super) fn is_valid(&self) -> bool {
        // P is symmetric, so its upper triangle is enough.
        (0..N).all(|i| {
            self.x[i].is_finite()
                && self.p[i][i] > 0.0
                && self.p[i][i..].iter().all(|p| p.is_finite())
        })
    }

    /// Updates the filter by a measurement.
    pub(super) fn update(&mut self, seen: &Observation) {
        let d = [0, 1, 2].map(|k| seen.motors[k] - self.motors[k]);
        (self.motors, self.variances) = (seen.motors, seen.variances);
        self.predict(d);
        let cables = Cables::new(&self.x);
        self.moved = along(&cables.j, scaled(seen.turned, cables.step));
        // The delay cannot be told from the position of a ball that moves evenly.
        let corrected = if seen.is_following { DELAY } else { N };
        self.correct(without_lag(seen, &cables), corrected);
        if !self.is_valid() {
            return;
        }
        if dot(self.bias, self.bias) > 1.0 && self.is_confident() {
            self.inflate_covariance();
        }
        self.clamp_state();
        self.cables = Cables::new(&self.x);
    }
}
