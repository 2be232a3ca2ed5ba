//! Extended Kalman filter over the ball, the motors' positions, the cable of a step and the delay
//! of the measurements: prediction, correction by an observation, and limits of the state.
#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns go by their numbers in several arrays at once"
)]

use plumb_protocol::dimension::{AXES, MOTORS, PerAxis, PerMotor};

use super::geometry::{
    Cables, DELAY, Gradient, Guess, Matrix, N, STEP, Vector, along, cable_vectors, dot, length,
    scaled,
};
use super::observation::Observation;
use crate::vector::{per_axis, per_motor};

/// Lag of the ball on its springs over its acceleration, squares of a frame time: 2 of them are
/// 0.002 s², 22 rad/s, between a stiff rig and a soft one.
const SPRING_LAG: f32 = 2.0;

/// One filter of the [multi-model filter](super::multi_model).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Filter {
    /// State; [`N`] lists its entries.
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
    #[cold]
    pub(super) fn new(seen: &Observation, target: Vector, guess: &Guess) -> Self {
        Self::begun(seen, guess.prior(seen.ball, seen.variances, target))
    }

    /// Creates the filter at the first measurement, with the state and covariance of a known rig;
    /// `None` for a rig far beyond what the filters know.
    #[cold]
    pub(super) fn knowing(seen: &Observation, known: ([f32; N], [[f32; N]; N])) -> Option<Self> {
        let mut filter = Self::begun(seen, known);
        filter.clamp_state();
        filter.cables = Cables::new(&filter.x);
        let is_near = |i: usize| (filter.x[i] - known.0[i]).abs() < MAX_BEYOND_MM;
        ((AXES..STEP).all(is_near) && filter.is_valid()).then_some(filter)
    }

    /// Creates the filter at the first measurement, with this state and covariance.
    fn begun(seen: &Observation, (x, p): ([f32; N], [[f32; N]; N])) -> Self {
        Self {
            x,
            p,
            cables: Cables::new(&x),
            variances: seen.variances,
            motors: seen.motors,
            moved: [0.0; AXES],
            score: 0.0,
            bias: [0.0; AXES],
            outliers: 0,
        }
    }

    /// Begins with this score instead of 0.
    pub(super) fn begin_behind(&mut self, score: f32) {
        self.score = score;
    }

    /// Returns the filter as at the first measurement, with this score.
    pub(super) fn restarted(seen: &Observation, target: Vector, guess: &Guess, score: f32) -> Self {
        Self { score, ..Self::new(seen, target, guess) }
    }

    /// Returns the state and its covariance.
    pub(super) fn state(&self) -> (&[f32; N], &[[f32; N]; N]) {
        (&self.x, &self.p)
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
        per_motor(|k| {
            let then = length(per_axis(|i| point[i] - self.x[3 + 3 * k + i]));
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
        let d = per_motor(|k| seen.motors[k] - self.motors[k]);
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

/// Process noise of a prediction.
struct ProcessNoise {
    /// Standard deviation of the position, mm.
    position_sd: f32,
    /// Standard deviation of the position over the ball's movement.
    position_per_move: f32,
    /// Standard deviation of a motor's coordinate over the ball's movement.
    motor_per_move: f32,
    /// Largest correction of the position for the bend of the way, mm.
    max_bend: f32,
}

const NOISE: ProcessNoise =
    ProcessNoise { position_sd: 0.05, position_per_move: 0.1, motor_per_move: 0.2, max_bend: 20.0 };

impl Filter {
    /// Predicts the state after the motors turned by `d` steps.
    pub(super) fn predict(&mut self, d: Vector) {
        let before = self.cables;
        let gradient = Gradient::new(&before, d);
        let moved = along(&before.j, gradient.paid);
        for i in 0..AXES {
            self.x[i] += moved[i];
        }
        // The way is bent: one Newton step corrects the lengths after the straight movement.
        let after = cable_vectors(&self.x).map(|v| length(v).max(1.0));
        let lacking = per_motor(|k| before.lengths[k] + gradient.paid[k] - after[k]);
        let bend = along(&before.j, lacking);
        for i in 0..AXES {
            self.x[i] += bend[i].clamp(-NOISE.max_bend, NOISE.max_bend);
        }
        let unknown = self.propagate(&gradient, &before.j);
        let square = dot(moved, moved);
        for i in 0..AXES {
            self.p[i][i] += NOISE.position_sd * NOISE.position_sd
                + NOISE.position_per_move * NOISE.position_per_move * square
                + unknown[i];
        }
        for i in 3..STEP {
            self.p[i][i] += NOISE.motor_per_move * NOISE.motor_per_move * square;
        }
    }

    /// Replaces P by (I + F) P (I + F)', where F = J G has three rows. Returns the diagonal of
    /// F P F'.
    fn propagate(&mut self, gradient: &Gradient, j: &Matrix) -> Vector {
        let gp = self.times_covariance(gradient);
        let spread = Self::spread(gradient, &gp);
        // J G P G' J'.
        let across = j.map(|row| along(&spread, row));
        let fpf = j.map(|row| across.map(|across| dot(row, across)));
        let fp: PerAxis<[f32; N]> =
            j.map(|row| core::array::from_fn(|n| dot(row, [gp[0][n], gp[1][n], gp[2][n]])));
        for i in 0..AXES {
            for k in 0..MOTORS {
                self.p[i][k] += fp[i][k] + fp[k][i] + fpf[i][k];
            }
            for k in 3..N {
                self.p[i][k] += fp[i][k];
                self.p[k][i] = self.p[i][k];
            }
        }
        per_axis(|i| fpf[i][i].max(0.0))
    }

    /// Returns the covariance of J a, mm², for `a` in steps.
    pub(in crate::law::taut) fn covariance(&self, a: Vector) -> Matrix {
        let j = &self.cables.j;
        let gradient = Gradient::new(&self.cables, a);
        let spread = Self::spread(&gradient, &self.times_covariance(&gradient));
        let across = j.map(|row| along(&spread, row));
        j.map(|row| across.map(|across| dot(row, across)))
    }

    /// Returns G P: three rows.
    fn times_covariance(&self, gradient: &Gradient) -> PerMotor<[f32; N]> {
        per_motor(|k| {
            let (w, paid) = (gradient.bends[k], gradient.paid[k]);
            let p = &self.p;
            let motor = 3 + 3 * k;
            core::array::from_fn(|n| {
                let bend = per_axis(|c| p[motor + c][n] - p[c][n]);
                dot(w, bend) + paid * p[STEP][n]
            })
        })
    }

    /// Returns G P G' from G P.
    fn spread(gradient: &Gradient, gp: &PerMotor<[f32; N]>) -> Matrix {
        let entry = |k: usize, l: usize| {
            let motor = 3 + 3 * l;
            let bend = per_axis(|c| gp[k][motor + c] - gp[k][c]);
            dot(gradient.bends[l], bend) + gradient.paid[l] * gp[k][STEP]
        };
        let (ab, ac, bc) = (entry(0, 1), entry(0, 2), entry(1, 2));
        [[entry(0, 0), ab, ac], [ab, entry(1, 1), bc], [ac, bc, entry(2, 2)]]
    }
}

/// Variance that the filter's model leaves out, mm².
const UNMODELLED_VARIANCE_MM2: f32 = 4.0;
/// Factor on the score from measurement to measurement: a memory of 200.
const SCORE_MEMORY: f32 = 0.995;
/// Innovation of an outlier, standard deviations.
const OUTLIER_SIGMAS: f32 = 4.0;
/// Outliers in a row that are skipped.
const MAX_SKIPPED: u8 = 2;
/// Score of a skipped measurement: that of an axis at the edge of [`OUTLIER_SIGMAS`].
const SKIPPED_SCORE: f32 = 30.0;
/// Highest score of a measurement.
const MAX_SCORE: f32 = 60.0;
/// Factor on the mean innovation from measurement to measurement: a memory of 10.
const BIAS_MEMORY: f32 = 0.9;
/// Weight of a measurement in the mean innovation.
const BIAS_WEIGHT: f32 = 0.1;

impl Filter {
    /// Corrects the first `corrected` entries of the state by a ball at `z`, one coordinate after
    /// the other. The others keep their uncertainty (Schmidt's filter).
    pub(super) fn correct(&mut self, z: Vector, corrected: usize) {
        if !self.accepts(z) {
            return;
        }
        let mut surprise = 0.0;
        for i in 0..AXES {
            let variance = self.variance(i);
            let precision = 1.0 / variance;
            let off = self.innovation(z, i);
            surprise += off * off * precision + libm::logf(variance);
            self.bias[i] = BIAS_MEMORY * self.bias[i] + BIAS_WEIGHT * off / libm::sqrtf(variance);
            let row: [f32; N] =
                core::array::from_fn(|k| self.p[i][k] - self.moved[i] * self.p[DELAY][k]);
            for k in 0..corrected {
                let gain = row[k] * precision;
                self.x[k] += gain * off;
                // P is symmetric: the lower triangle is copied.
                for l in k..N {
                    self.p[k][l] -= gain * row[l];
                    self.p[l][k] = self.p[k][l];
                }
            }
        }
        self.score = SCORE_MEMORY * self.score + surprise.min(MAX_SCORE);
    }

    /// Returns whether a measurement of the ball at `z` is to be used. Outliers are skipped. After
    /// [`MAX_SKIPPED`] in a row the ball has really moved: the variance of its position grows, and
    /// the geometry stays.
    fn accepts(&mut self, z: Vector) -> bool {
        let off = per_axis(|i| self.innovation(z, i));
        let outlier =
            per_axis(|i| off[i] * off[i] > OUTLIER_SIGMAS * OUTLIER_SIGMAS * self.variance(i));
        if outlier == [false; AXES] {
            self.outliers = 0;
            return true;
        }
        self.outliers = self.outliers.saturating_add(1);
        if self.outliers <= MAX_SKIPPED {
            self.score = SCORE_MEMORY * self.score + SKIPPED_SCORE;
            return false;
        }
        for i in 0..AXES {
            if outlier[i] {
                self.p[i][i] += off[i] * off[i];
            }
        }
        true
    }

    /// Returns the innovation of a ball at `z` along an axis, mm: the prediction is the position
    /// before the measurement's delay.
    fn innovation(&self, z: Vector, axis: usize) -> f32 {
        z[axis] - (self.x[axis] - self.moved[axis] * self.x[DELAY])
    }

    /// Returns the variance of the innovation along an axis, mm².
    fn variance(&self, axis: usize) -> f32 {
        let moved = self.moved[axis];
        let late = moved * (moved * self.p[DELAY][DELAY] - 2.0 * self.p[axis][DELAY]);
        (self.p[axis][axis] + late).max(0.0) + self.variances[axis] + UNMODELLED_VARIANCE_MM2
    }
}

/// Largest distance of a motor from the ball along an axis, mm.
const MAX_MOTOR_DISTANCE_MM: f32 = 1600.0;
/// Distance by which a coordinate of a known rig may be beyond these and [`BOUNDS`], mm.
const MAX_BEYOND_MM: f32 = 100.0;
/// Range of ln s: cable of a step from 0.1 to 1.5 mm.
const LN_STEP_RANGE: (f32, f32) = (-core::f32::consts::LN_10, 0.405_465);
/// Range of the measurements' delay beyond their age, frame times.
const DELAY_RANGE: (f32, f32) = (-1.0, 5.0);
/// Standard deviation of a motor's coordinate below which the filter is confident, mm.
const CONFIDENT_MOTOR_MM: f32 = 260.0;
/// Standard deviation of ln s below which the filter is confident.
const CONFIDENT_LN_STEP: f32 = 0.4;
/// Factor on the standard deviations of the geometry where a confident filter is biased.
const INFLATION: f32 = 1.05;

/// Bounds on the motors' positions relative to the ball and to each other, mm: A and B on the side
/// of larger x, C opposite, A at larger y than B, all above the ball.
struct MotorBounds {
    /// Least height of a motor above the ball.
    min_height: f32,
    /// Least distance along x from the ball.
    min_x: f32,
    /// Least y of A, and the negative of the largest y of B, relative to the ball.
    min_y: f32,
    /// Least distance along y of A from B.
    min_apart: f32,
}

const BOUNDS: MotorBounds =
    MotorBounds { min_height: 60.0, min_x: 15.0, min_y: -100.0, min_apart: 250.0 };

impl Filter {
    /// Returns whether the variances of the geometry are small.
    pub(super) fn is_confident(&self) -> bool {
        (3..STEP).all(|i| self.p[i][i] < CONFIDENT_MOTOR_MM * CONFIDENT_MOTOR_MM)
            && self.p[STEP][STEP] < CONFIDENT_LN_STEP * CONFIDENT_LN_STEP
    }

    /// Inflates the covariance of the geometry: the innovations are biased.
    pub(super) fn inflate_covariance(&mut self) {
        for i in 0..N {
            for k in 0..N {
                let factor =
                    if i >= 3 { INFLATION } else { 1.0 } * if k >= 3 { INFLATION } else { 1.0 };
                self.p[i][k] *= factor;
            }
        }
    }

    /// Clamps the state to [`BOUNDS`] and to the ranges of the other entries.
    pub(super) fn clamp_state(&mut self) {
        let x = &mut self.x;
        let ball = [x[0], x[1], x[2]];
        for z in [5, 8, 11] {
            x[z] = x[z].max(ball[2] + BOUNDS.min_height);
        }
        x[3] = x[3].max(ball[0] + BOUNDS.min_x);
        x[6] = x[6].max(ball[0] + BOUNDS.min_x);
        x[9] = x[9].min(ball[0] - BOUNDS.min_x);
        x[4] = x[4].max(ball[1] + BOUNDS.min_y);
        x[7] = x[7].min(ball[1] - BOUNDS.min_y);
        x[4] = x[4].max(x[7] + BOUNDS.min_apart);
        x[10] = x[10].max(x[7]).min(x[4]);
        for i in 3..STEP {
            let centre = ball[i % 3];
            x[i] = x[i].max(centre - MAX_MOTOR_DISTANCE_MM).min(centre + MAX_MOTOR_DISTANCE_MM);
        }
        x[DELAY] = x[DELAY].max(DELAY_RANGE.0).min(DELAY_RANGE.1);
        x[STEP] = x[STEP].max(LN_STEP_RANGE.0).min(LN_STEP_RANGE.1);
    }
}
