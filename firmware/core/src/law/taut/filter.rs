//! An extended Kalman filter over the ball, the motors' points, the cable of a step and the
//! pictures' lateness.
#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns go by their numbers in several arrays at once"
)]

use super::geometry::{Matrix, Vector, along, dot, inverse, length, scaled};
use super::prior::{Guess, LATE, N, STEP};
use super::seen::Seen;

/// Variance of what the filter's model leaves out, mm².
const UNMODELLED: f32 = 4.0;
/// Motors are not farther from the ball than this, mm.
const FARTHEST: f32 = 1600.0;
/// ln 0.1 and ln 1.5: cable of a step, mm.
const STEPS: (f32, f32) = (-core::f32::consts::LN_10, 0.405_465);
/// Pictures are later than told by so many pictures' times, at least and at most.
const LATENESS: (f32, f32) = (-1.0, 5.0);
/// What is left of the score from a picture to the next.
const FORGOTTEN: f32 = 0.995;
/// A coordinate that is farther off than so many standard deviations is strange.
const STRANGE: f32 = 4.0;
/// So many strange pictures in a row are passed over.
const PATIENCE: u8 = 2;
/// What a picture that is passed over adds to the score: as much as an axis at the edge of that.
const PASSED_OVER: f32 = 30.0;
/// How far the ball hangs behind on its springs, over its acceleration, squares of a picture's
/// time: 2 of them are 0.002 s², 22 rad/s, between a stiff rig and a soft one.
const BEHIND: f32 = 2.0;

/// One filter of the bank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Filter {
    x: [f32; N],
    p: [[f32; N]; N],
    /// What x says of the cables, as it was left by the last picture.
    cables: Cables,
    /// How sure the last picture was, mm².
    told: Vector,
    /// Where the motors were, steps.
    motors: Vector,
    /// How far the ball went in a picture's time before the last picture, mm.
    flown: Vector,
    /// Twice the negative logarithm of the likelihood of what was seen, forgotten over 200
    /// pictures.
    score: f32,
    /// Innovations over their standard deviations, forgotten over 10 pictures.
    bias: Vector,
    /// Pictures in a row that were strange.
    strange: u8,
}

/// Directions and lengths of the cables at an estimate, and ṗ per cable rate.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cables {
    units: Matrix,
    lengths: Vector,
    j: Matrix,
    step: f32,
}

/// From each motor to the ball.
fn cable_vectors(x: &[f32; N]) -> Matrix {
    [0, 1, 2].map(|k| [0, 1, 2].map(|c| x[c] - x[3 + 3 * k + c]))
}

impl Cables {
    fn new(x: &[f32; N]) -> Self {
        let from = cable_vectors(x);
        let lengths = from.map(|v| length(v).max(1.0));
        let units = [0, 1, 2].map(|k| scaled(from[k], 1.0 / lengths[k]));
        Self { units, lengths, j: inverse(&units), step: libm::expf(x[STEP]) }
    }
}

/// How the way of the ball changes with the state when the motors turn: F = J G. Row k of G is -w_k
/// at the ball, w_k at motor k, and what is paid out at ln s: seven entries of thirteen.
struct Gradient {
    /// w_k: how far the ball goes across cable k, over its length.
    bends: Matrix,
    /// Cable that each motor pays out, mm.
    paid: Vector,
}

impl Gradient {
    fn new(cables: &Cables, d: Vector) -> Self {
        let paid = scaled(d, cables.step);
        let moved = along(&cables.j, paid);
        let bends = [0, 1, 2].map(|k| {
            let unit = cables.units[k];
            // Along the cable the ball goes as far as it is paid out.
            let part = dot(unit, moved);
            scaled([0, 1, 2].map(|c| moved[c] - part * unit[c]), 1.0 / cables.lengths[k])
        });
        Self { bends, paid }
    }
}

/// Where the cables' lengths would have the ball that is seen: on springs it comes later while it
/// gets faster.
fn ahead_of(seen: &Seen, cables: &Cables) -> Vector {
    let behind = along(&cables.j, scaled(seen.faster, BEHIND * cables.step));
    // The weight holds it against that downwards.
    [seen.ball[0] + behind[0], seen.ball[1] + behind[1], seen.ball[2]]
}

impl Filter {
    /// At the first picture, on the way to `target` (mm).
    pub(super) fn new(seen: &Seen, target: Vector, guess: &Guess) -> Self {
        let Seen { ball, variances: told, motors, .. } = *seen;
        let (x, p) = guess.prior(ball, told, target);
        let cables = Cables::new(&x);
        Self { x, p, cables, told, motors, flown: [0.0; 3], score: 0.0, bias: [0.0; 3], strange: 0 }
    }

    /// The ball, mm.
    pub(super) fn ball(&self) -> Vector {
        [self.x[0], self.x[1], self.x[2]]
    }

    /// How badly it explains what was seen.
    pub(super) fn score(&self) -> f32 {
        self.score
    }

    /// J, mm a step.
    pub(super) fn jacobian(&self) -> Matrix {
        let Cables { j, step, .. } = self.cables;
        j.map(|row| row.map(|j| step * j))
    }

    /// G P: three rows.
    fn times_covariance(&self, gradient: &Gradient) -> [[f32; N]; 3] {
        [0, 1, 2].map(|k| {
            let (w, paid) = (gradient.bends[k], gradient.paid[k]);
            let p = &self.p;
            let motor = 3 + 3 * k;
            core::array::from_fn(|n| {
                let bend = [0, 1, 2].map(|c| p[motor + c][n] - p[c][n]);
                dot(w, bend) + paid * p[STEP][n]
            })
        })
    }

    /// G P G', of G P.
    fn spread(gradient: &Gradient, gp: &[[f32; N]; 3]) -> Matrix {
        let entry = |k: usize, l: usize| {
            let motor = 3 + 3 * l;
            let bend = [0, 1, 2].map(|c| gp[k][motor + c] - gp[k][c]);
            dot(gradient.bends[l], bend) + gradient.paid[l] * gp[k][STEP]
        };
        let (ab, ac, bc) = (entry(0, 1), entry(0, 2), entry(1, 2));
        [[entry(0, 0), ab, ac], [ab, entry(1, 1), bc], [ac, bc, entry(2, 2)]]
    }

    /// The covariance of J a, mm².
    pub(super) fn covariance(&self, a: Vector) -> Matrix {
        let j = &self.cables.j;
        let gradient = Gradient::new(&self.cables, a);
        let spread = Self::spread(&gradient, &self.times_covariance(&gradient));
        let across = j.map(|row| along(&spread, row));
        j.map(|row| across.map(|across| dot(row, across)))
    }

    /// Motor steps from where the ball is to where its cables reach `point` (mm): by their lengths,
    /// not by J, which near the motors doubles within a few centimetres.
    pub(super) fn steps_to(&self, point: Vector) -> Vector {
        let Cables { lengths, step, .. } = self.cables;
        [0, 1, 2].map(|k| {
            let then = length([0, 1, 2].map(|i| point[i] - self.x[3 + 3 * k + i]));
            (then - lengths[k]) / step
        })
    }

    /// How far the motors are above the ball in the mean, mm.
    pub(super) fn height(&self) -> f32 {
        (self.x[5] + self.x[8] + self.x[11]) / 3.0 - self.x[2]
    }

    /// Whether all of it is numbers, and the covariance one: rounding may spoil a filter that is
    /// very sure of itself.
    pub(super) fn sound(&self) -> bool {
        // What is below the diagonal is the same as what is above it.
        (0..N).all(|i| {
            self.x[i].is_finite()
                && self.p[i][i] > 0.0
                && self.p[i][i..].iter().all(|p| p.is_finite())
        })
    }

    /// The same filter begun anew, scored as one that has explained things as badly as `score`
    /// says.
    pub(super) fn restarted(seen: &Seen, target: Vector, guess: &Guess, score: f32) -> Self {
        Self { score, ..Self::new(seen, target, guess) }
    }

    /// Takes in a picture.
    pub(super) fn update(&mut self, seen: &Seen) {
        let d = [0, 1, 2].map(|k| seen.motors[k] - self.motors[k]);
        (self.motors, self.told) = (seen.motors, seen.variances);
        self.predict(d);
        let cables = Cables::new(&self.x);
        self.flown = along(&cables.j, scaled(seen.turned, cables.step));
        self.measure(ahead_of(seen, &cables));
        if !self.sound() {
            return;
        }
        if dot(self.bias, self.bias) > 1.0 && self.still_sure() {
            self.doubt_itself();
        }
        self.keep_possible();
        self.cables = Cables::new(&self.x);
    }

    fn predict(&mut self, d: Vector) {
        let before = self.cables;
        let gradient = Gradient::new(&before, d);
        let moved = along(&before.j, gradient.paid);
        for i in 0..3 {
            self.x[i] += moved[i];
        }
        // The way is bent: what the lengths lack after the straight step.
        let after = cable_vectors(&self.x).map(|v| length(v).max(1.0));
        let lacking = [0, 1, 2].map(|k| before.lengths[k] + gradient.paid[k] - after[k]);
        let back = along(&before.j, lacking);
        for i in 0..3 {
            self.x[i] += back[i].clamp(-20.0, 20.0);
        }
        let unknown = self.propagate(&gradient, &before.j);
        let square = dot(moved, moved);
        for i in 0..3 {
            self.p[i][i] += 0.05 * 0.05 + 0.1 * 0.1 * square + unknown[i];
        }
        for i in 3..STEP {
            self.p[i][i] += 0.2 * 0.2 * square;
        }
    }

    /// P becomes (I + F) P (I + F)', where F = J G has three rows; the diagonal of F P F'.
    fn propagate(&mut self, gradient: &Gradient, j: &Matrix) -> Vector {
        let gp = self.times_covariance(gradient);
        let spread = Self::spread(gradient, &gp);
        // J G P G' J'.
        let across = j.map(|row| along(&spread, row));
        let fpf = j.map(|row| across.map(|across| dot(row, across)));
        let fp: [[f32; N]; 3] =
            j.map(|row| core::array::from_fn(|n| dot(row, [gp[0][n], gp[1][n], gp[2][n]])));
        for i in 0..3 {
            for k in 0..3 {
                self.p[i][k] += fp[i][k] + fp[k][i] + fpf[i][k];
            }
            for k in 3..N {
                self.p[i][k] += fp[i][k];
                self.p[k][i] = self.p[i][k];
            }
        }
        [0, 1, 2].map(|i| fpf[i][i].max(0.0))
    }

    /// How far a ball that is seen at `z` is from where it is expected along an axis: where it was
    /// by the pictures' lateness ago.
    fn off(&self, z: Vector, axis: usize) -> f32 {
        z[axis] - (self.x[axis] - self.flown[axis] * self.x[LATE])
    }

    fn variance(&self, axis: usize) -> f32 {
        let flown = self.flown[axis];
        let late = flown * (flown * self.p[LATE][LATE] - 2.0 * self.p[axis][LATE]);
        (self.p[axis][axis] + late).max(0.0) + self.told[axis] + UNMODELLED
    }

    /// Whether to take in a picture of the ball at `z`. Strange ones are passed over; where they go
    /// on, the ball is elsewhere indeed, and how it came there says little of the geometry.
    fn accepts(&mut self, z: Vector) -> bool {
        let off = [0, 1, 2].map(|i| self.off(z, i));
        let strange = [0, 1, 2].map(|i| off[i] * off[i] > STRANGE * STRANGE * self.variance(i));
        if strange == [false; 3] {
            self.strange = 0;
            return true;
        }
        self.strange = self.strange.saturating_add(1);
        if self.strange <= PATIENCE {
            self.score = FORGOTTEN * self.score + PASSED_OVER;
            return false;
        }
        for i in 0..3 {
            if strange[i] {
                self.p[i][i] += off[i] * off[i];
            }
        }
        true
    }

    /// The three coordinates one after the other.
    fn measure(&mut self, z: Vector) {
        if !self.accepts(z) {
            return;
        }
        let mut surprise = 0.0;
        for i in 0..3 {
            let variance = self.variance(i);
            let precision = 1.0 / variance;
            let off = self.off(z, i);
            surprise += off * off * precision + libm::logf(variance);
            self.bias[i] = 0.9 * self.bias[i] + 0.1 * off / libm::sqrtf(variance);
            let row: [f32; N] =
                core::array::from_fn(|k| self.p[i][k] - self.flown[i] * self.p[LATE][k]);
            for k in 0..N {
                let gain = row[k] * precision;
                self.x[k] += gain * off;
                // What is below the diagonal is the same as what is above it.
                for l in k..N {
                    self.p[k][l] -= gain * row[l];
                    self.p[l][k] = self.p[k][l];
                }
            }
        }
        self.score = FORGOTTEN * self.score + surprise.min(60.0);
    }

    /// Whether it takes the geometry for known.
    fn still_sure(&self) -> bool {
        (3..STEP).all(|i| self.p[i][i] < 260.0 * 260.0) && self.p[STEP][STEP] < 0.4 * 0.4
    }

    /// The geometry is less certain by a twentieth: pictures have been off to one side.
    fn doubt_itself(&mut self) {
        for i in 0..N {
            for k in 0..N {
                let factor = if i >= 3 { 1.05 } else { 1.0 } * if k >= 3 { 1.05 } else { 1.0 };
                self.p[i][k] *= factor;
            }
        }
    }

    /// Motors are above the ball and about it as A, B and C are.
    fn keep_possible(&mut self) {
        let x = &mut self.x;
        let ball = [x[0], x[1], x[2]];
        for z in [5, 8, 11] {
            x[z] = x[z].max(ball[2] + 60.0);
        }
        x[3] = x[3].max(ball[0] + 15.0);
        x[6] = x[6].max(ball[0] + 15.0);
        x[9] = x[9].min(ball[0] - 15.0);
        x[4] = x[4].max(ball[1] - 100.0);
        x[7] = x[7].min(ball[1] + 100.0);
        x[4] = x[4].max(x[7] + 250.0);
        x[10] = x[10].max(x[7]).min(x[4]);
        for i in 3..STEP {
            let centre = ball[i % 3];
            x[i] = x[i].max(centre - FARTHEST).min(centre + FARTHEST);
        }
        x[LATE] = x[LATE].max(LATENESS.0).min(LATENESS.1);
        x[STEP] = x[STEP].max(STEPS.0).min(STEPS.1);
    }
}
