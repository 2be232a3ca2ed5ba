//! Kalman filter of one coordinate of the ball and of its row of the Jacobian, in fixed point.
//!
//! State: position p, and the row (J_A, J_B, J_C), which changes by noise only. Formats: p Q4 µm,
//! J Q6 µm/step, P_JJ Q8, P_pJ Q4, P_pp Q0 (µm, steps); gains K_p Q16, K_J Q20; motor steps Q4.

#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns go by their numbers in several arrays at once"
)]

use plumb_protocol::dimension::{MOTORS, PerMotor};

use super::fixed_point::{movement, times};
use crate::vector::per_motor;

/// Saturation of J: 8.2 mm/step in Q6 µm/step.
const J_MAX: i64 = (1 << 19) - 1;
/// Saturation of P_JJ: (2 mm/step)² in Q8 (µm/step)².
const P_JJ_MAX: i64 = (1 << 30) - 1;
/// Saturation of P_pp: (32 mm)² in µm².
const P_PP_MAX: i64 = (1 << 30) - 1;
/// Bound of P_pJ by the Cauchy-Schwarz inequality: 15 + 11 + 4 bits.
const P_PJ_MAX: i64 = (1 << 30) - 1;
/// Turn of a motor between two measurements, Q4 steps (512 steps), from which on the prediction is
/// dropped: P_pp saturates.
pub(super) const MAX_TURN: i32 = 1 << 13;
/// Process noise of the position, µm² a measurement: (50 µm)².
const POSITION_NOISE_UM2: i64 = 50 * 50;
/// Highest count of measurements in a row of a ball at its target. Their noise may be correlated,
/// so the nth has 1 + n/4 times its variance, up to this n.
pub(super) const MAX_HELD: u8 = 28;
/// 1/4 in that formula, as a shift.
const HELD_BITS: u32 = 2;

/// Kalman filter of one coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct AxisKalman {
    /// Position, Q4 µm.
    pub(super) p: i32,
    /// Row of the Jacobian, Q6 µm/step.
    pub(super) j: PerMotor<i32>,
    /// Covariance of the row, Q8 (µm/step)².
    pub(super) p_jj: PerMotor<PerMotor<i32>>,
    /// Covariance of position and row, Q4 µm²/step.
    p_pj: PerMotor<i32>,
    /// Variance of the position, µm².
    p_pp: i32,
    /// Process noise of each entry of the row, as a share of the full one in 1/256.
    noise: PerMotor<i32>,
    /// Whether the row also changes by a common factor, as the ball moves along this axis.
    scales: bool,
}

/// A measurement compared with the prediction.
struct Innovation {
    /// Variance of the measurement and of the prediction together, µm².
    s: i64,
    /// Measurement minus prediction, Q4 µm.
    innovation: i64,
    /// Gain for the position, Q16.
    k_p: i64,
}

/// Saturates `value` at ±`limit`, which fits an i32.
fn saturated(value: i64, limit: i64) -> i32 {
    value.clamp(-limit, limit) as i32
}

impl AxisKalman {
    /// Creates the filter at the first measurement: at `p` (µm), with the row `j` (Q6), its
    /// covariance `p_jj` (Q8), and the `variance` of the measurement (µm²).
    pub(super) fn new(
        p: i32,
        j: PerMotor<i32>,
        p_jj: PerMotor<PerMotor<i32>>,
        variance: i32,
        noise: PerMotor<i32>,
    ) -> Self {
        Self { p: p << 4, j, p_jj, p_pj: [0; MOTORS], p_pp: variance, noise, scales: false }
    }

    /// Returns the filter with noise that scales the whole row: along z, J is inversely
    /// proportional to the ball's distance from the motors' plane.
    pub(super) fn with_scale_noise(self) -> Self {
        Self { scales: true, ..self }
    }

    /// Predicts the state after the motors turned by `d` (Q4 steps, 13 bits and a sign), with
    /// `noise` / 32 of the row's noise, at most all of it.
    pub(super) fn predict(&mut self, d: PerMotor<i32>, noise: i64) {
        if d.iter().any(|d| d.abs() >= MAX_TURN) {
            (self.p_pp, self.p_pj) = (P_PP_MAX as i32, [0; MOTORS]);
            return;
        }
        let d = d.map(i64::from);
        // Bits: 19 + 13 = 32, 34 the sum.
        let moved = movement(self.j, d);
        self.p = self.p.saturating_add(moved as i32);
        // P_JJ d, bits: 30 + 13 = 43, 45 the sum; Q12 to Q4 and within 30 bits.
        let spread = per_motor(|k| {
            let sum: i64 = (0..MOTORS).map(|l| times(self.p_jj[k][l].into(), d[l])).sum();
            (sum >> 8).clamp(-P_PJ_MAX, P_PJ_MAX)
        });
        // P_pp + 2 d'P_pJ + d'P_JJ d, bits: 31 + 13 = 44, 46 the sum; Q8 to Q0.
        let grown: i64 =
            (0..MOTORS).map(|k| times(d[k], 2 * i64::from(self.p_pj[k]) + spread[k])).sum::<i64>()
                >> 8;
        // (0.02 J d)² in µm², bits: 22 + 22; Q8; /2500.
        let jump = moved.clamp(-(1 << 22), 1 << 22);
        let bent = times(jump, jump) / (2500 * 256);
        let p_pp = (i64::from(self.p_pp) + grown + bent + POSITION_NOISE_UM2).max(1);
        // Where P_pp saturates, P_pJ shrinks with it, by this factor in Q16: the gains stay as they
        // were, and P stays positive definite.
        let kept = if p_pp > P_PP_MAX { (P_PP_MAX << 16) / p_pp } else { 1 << 16 };
        self.p_pp = p_pp.min(P_PP_MAX) as i32;
        for k in 0..MOTORS {
            // Bits: 31 + 16.
            let sum = times(i64::from(self.p_pj[k]) + spread[k], kept);
            self.p_pj[k] = saturated(sum >> 16, P_PJ_MAX);
        }
        self.add_row_noise(d, noise);
        if self.scales {
            self.add_scale_noise(bent);
        }
    }

    /// Adds (0.01 max|J|)² to P_JJ for each step that any motor turned, times `noise` / 32.
    fn add_row_noise(&mut self, d: PerMotor<i64>, noise: i64) {
        let largest = self.j.iter().map(|j| i64::from(j.abs())).max().unwrap_or(0);
        let turned: i64 = d.iter().map(|d| d.abs()).sum();
        // Bits: (19 + 19) - 12 = 26, times 15 + 5 is 46, Q4; /10^4, /32 and to Q8.
        let growth = times(times(largest, largest) >> 12, turned * noise) / 20_000;
        for k in 0..MOTORS {
            // Bits: at most 32 + 9.
            let own = times(growth, self.noise[k].into()) >> 8;
            self.p_jj[k][k] = (i64::from(self.p_jj[k][k]) + own).min(P_JJ_MAX) as i32;
        }
    }

    /// Adds J J' (moved / 102 mm)² to P_JJ: noise that all entries have in common. `bent` is
    /// (moved / 50)² in µm². Skipped where the sum would not fit: saturated, P_JJ would no
    /// longer be positive definite.
    fn add_scale_noise(&mut self, bent: i64) {
        // Q16; at most half of J.
        let part = (bent >> 6).min(1 << 14);
        let j = self.j.map(i64::from);
        // Bits: 38 - 12 + 15; Q12 to Q0, then Q16 to Q8.
        let grown = |k: usize, l: usize| {
            i64::from(self.p_jj[k][l]) + (times(times(j[k], j[l]) >> 12, part) >> 8)
        };
        let diagonal = per_motor(|k| grown(k, k));
        if diagonal.iter().all(|&p| p <= P_JJ_MAX) {
            let [[ab, ac], [_, bc]] = [0, 1].map(|k| [1, 2].map(|l| grown(k, l)));
            let [aa, bb, cc] = diagonal;
            self.p_jj = [[aa, ab, ac], [ab, bb, bc], [ac, bc, cc]].map(|row| row.map(|p| p as i32));
        }
    }

    /// Changes the row by `change` (Q6 µm/step).
    pub(super) fn change_row(&mut self, change: PerMotor<i32>) {
        for k in 0..MOTORS {
            let j = i64::from(self.j[k]) + i64::from(change[k]);
            self.j[k] = saturated(j, J_MAX);
        }
    }

    /// Updates the state by a measurement `z` (µm) of this variance (µm², 30 bits). An
    /// innovation saturates at 4 standard deviations.
    pub(super) fn update(&mut self, z: i32, variance: i32) {
        let innovation = self.innovation(z, variance.into());
        self.correct_row(&innovation);
        self.correct_position(&innovation);
    }

    /// Updates the position alone, by the `n`th measurement in a row of a ball at its target. Such
    /// a ball hardly moves but by its law's response to noise, so J and P_JJ stay.
    pub(super) fn update_held(&mut self, z: i32, variance: i32, n: u8) {
        let times_more = (1 << HELD_BITS) + i64::from(n.min(MAX_HELD));
        let innovation = self.innovation(z, times(variance.into(), times_more) >> HELD_BITS);
        self.correct_position(&innovation);
    }

    /// Compares a measurement `z` (µm) of this variance (µm², 33 bits) with the prediction.
    fn innovation(&self, z: i32, variance: i64) -> Innovation {
        let s = i64::from(self.p_pp) + variance;
        // 4 sqrt(s) in Q4, bits: 17 of the root, 2 of the factor 4, 4 of the format.
        let most = (s.unsigned_abs().isqrt() << 6) as i64;
        let innovation = ((i64::from(z) << 4) - i64::from(self.p)).clamp(-most, most);
        // Bits: 30 + 16.
        Innovation { s, innovation, k_p: (i64::from(self.p_pp) << 16) / s }
    }

    /// Corrects J and P_JJ.
    fn correct_row(&mut self, &Innovation { s, innovation, .. }: &Innovation) {
        // K_J in Q20, bits: 30 + 16.
        let k_j = self.p_pj.map(|c| (i64::from(c) << 16) / s);
        let p_pj = self.p_pj.map(i64::from);
        for k in 0..MOTORS {
            // Bits: K_J |innovation| <= 4 sd(J), 11 + 2 + 24 = 37; Q24 to Q6.
            let change = times(k_j[k], innovation) >> 18;
            self.j[k] = saturated(i64::from(self.j[k]) + change, J_MAX);
            for l in 0..MOTORS {
                // Bits: K_J P_pJ <= P_JJ by Cauchy-Schwarz, 30 + 16 = 46; Q24 to Q8. Ordered by k
                // and l, so that P stays symmetric.
                let less = times(k_j[k.min(l)], p_pj[k.max(l)]) >> 16;
                let least = if k == l { 1 } else { -P_JJ_MAX };
                self.p_jj[k][l] = (i64::from(self.p_jj[k][l]) - less).clamp(least, P_JJ_MAX) as i32;
            }
        }
    }

    /// Corrects p, P_pJ and P_pp.
    fn correct_position(&mut self, &Innovation { innovation, k_p, .. }: &Innovation) {
        // Bits: 16 + 23.
        self.p = self.p.saturating_add((times(k_p, innovation) >> 16) as i32);
        // Bits: 16 + 30, both.
        self.p_pj =
            self.p_pj.map(|c| saturated(i64::from(c) - (times(k_p, c.into()) >> 16), P_PJ_MAX));
        let p_pp = i64::from(self.p_pp);
        self.p_pp = (p_pp - (times(k_p, p_pp) >> 16)).max(1) as i32;
    }

    /// Returns a quarter of the variance of J·n, µm², for `n` motor steps (at most 13 bits and a
    /// sign): 50 bits.
    pub(super) fn variance_of(&self, n: PerMotor<i32>) -> u64 {
        let n = n.map(i64::from);
        // n'P n, bits: 30 + 13 = 43, 45 the sum; Q8, 10 bits less, 35; times 13 is 48, the sum of
        // three 50.
        let square: i64 = (0..MOTORS)
            .map(|k| {
                times(
                    n[k],
                    (0..MOTORS).map(|l| times(self.p_jj[k][l].into(), n[l])).sum::<i64>() >> 10,
                )
            })
            .sum();
        // Rounding may leave a value below zero.
        square.max(0).unsigned_abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows that nearly fill their format, with a ball that moves as far as it can and back.
    #[test]
    fn the_covariance_stays_positive_definite_where_it_saturates() {
        let j = [-300_000, -40_000, -170_000];
        let p_jj = [0, 1, 2].map(|k| [0, 1, 2].map(|l| if k == l { 1 << 29 } else { 0 }));
        let mut axis = AxisKalman::new(0, j, p_jj, 1_000_000, [256; 3]).with_scale_noise();
        for k in 0..200 {
            let way = if k / 20 % 2 == 0 { 40 } else { -40 };
            axis.predict([way, way / 2, way * (k % 3)], 32);
            axis.update((axis.p >> 4) + 500 * (k % 5 - 2), 1_000_000);
            for (k, l) in [(0, 1), (0, 2), (1, 2)] {
                let [kl, kk, ll] =
                    [(k, l), (k, k), (l, l)].map(|(k, l)| f64::from(axis.p_jj[k][l]));
                // A tolerance for rounding.
                assert!(kl * kl <= kk * ll * 1.001 + 1e6, "{:?}", axis.p_jj);
            }
        }
    }
}
