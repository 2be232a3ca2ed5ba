//! Prediction of the state and its covariance by the turns of the motors.
#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns go by their numbers in several arrays at once"
)]

use super::Filter;
use crate::law::taut::cables::{Gradient, cable_vectors};
use crate::law::taut::geometry::{Matrix, Vector, along, dot, length};
use crate::law::taut::prior::{N, STEP};

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
        for i in 0..3 {
            self.x[i] += moved[i];
        }
        // The way is bent: one Newton step corrects the lengths after the straight movement.
        let after = cable_vectors(&self.x).map(|v| length(v).max(1.0));
        let lacking = [0, 1, 2].map(|k| before.lengths[k] + gradient.paid[k] - after[k]);
        let bend = along(&before.j, lacking);
        for i in 0..3 {
            self.x[i] += bend[i].clamp(-NOISE.max_bend, NOISE.max_bend);
        }
        let unknown = self.propagate(&gradient, &before.j);
        let square = dot(moved, moved);
        for i in 0..3 {
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

    /// Returns the covariance of J a, mm², for `a` in steps.
    pub(in crate::law::taut) fn covariance(&self, a: Vector) -> Matrix {
        let j = &self.cables.j;
        let gradient = Gradient::new(&self.cables, a);
        let spread = Self::spread(&gradient, &self.times_covariance(&gradient));
        let across = j.map(|row| along(&spread, row));
        j.map(|row| across.map(|across| dot(row, across)))
    }

    /// Returns G P: three rows.
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

    /// Returns G P G' from G P.
    fn spread(gradient: &Gradient, gp: &[[f32; N]; 3]) -> Matrix {
        let entry = |k: usize, l: usize| {
            let motor = 3 + 3 * l;
            let bend = [0, 1, 2].map(|c| gp[k][motor + c] - gp[k][c]);
            dot(gradient.bends[l], bend) + gradient.paid[l] * gp[k][STEP]
        };
        let (ab, ac, bc) = (entry(0, 1), entry(0, 2), entry(1, 2));
        [[entry(0, 0), ab, ac], [ab, entry(1, 1), bc], [ac, bc, entry(2, 2)]]
    }
}
