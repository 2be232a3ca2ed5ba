//! What is known of one coordinate of the ball and of how the motors move it: a Kalman filter in
//! fixed point.
//!
//! State: p, and the row (J_A, J_B, J_C) of the Jacobian, which does not change but by noise.
//! Formats: p Q4 µm, J Q6 µm/step, P_JJ Q8, P_pJ Q4, P_pp Q0 (µm, steps); K_p Q16, K_J Q20; motor
//! steps Q4.

#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns go by their numbers in several arrays at once"
)]

use super::fixed_point::times;

/// J saturates here: 8.2 mm a step in Q6.
const J_MAX: i64 = (1 << 19) - 1;
/// P_JJ saturates here: (2 mm/step)² in Q8.
const P_JJ_MAX: i64 = (1 << 30) - 1;
/// P_pp saturates here: (32 mm)².
const P_PP_MAX: i64 = (1 << 30) - 1;
/// P_pJ cannot be larger by the inequality of Cauchy and Schwarz: 15 + 11 + 4 bits.
const P_PJ_MAX: i64 = (1 << 30) - 1;
/// Motors that turned farther than this between two pictures (Q4: 512 steps) say nothing of where
/// the ball is now.
const FAR: i32 = 1 << 13;
/// What moves the ball besides the motors, µm² a picture: 50 µm.
const WANDER: i64 = 50 * 50;
/// The more pictures in a row there are of a ball that is held, the less each tells of where it is,
/// since their noise may be the same: an nth has 1 + n/4 times its variance, up to n = 28.
pub(super) const HELD_MOST: u8 = 28;
const HELD_BITS: u32 = 2;

/// The filter of one coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Axis {
    /// Q4 µm.
    pub(super) p: i32,
    /// Q6 µm/step.
    pub(super) j: [i32; 3],
    /// Q8 (µm/step)².
    pub(super) p_jj: [[i32; 3]; 3],
    p_pj: [i32; 3],
    p_pp: i32,
    /// By how much slower than the others each entry changes: noise in 1/256.
    noise: [i32; 3],
    /// Whether the row also changes as a whole, as the ball moves along this axis.
    scales: bool,
}

/// A measurement as the filter sees it.
struct Measured {
    /// Its variance and that of what was expected, µm².
    s: i64,
    /// What is new in it, Q4 µm.
    innovation: i64,
    /// What of that the ball has moved by, Q16.
    k_p: i64,
}

/// `value` within ±`limit`, which fits an i32.
fn fit(value: i64, limit: i64) -> i32 {
    value.clamp(-limit, limit) as i32
}

impl Axis {
    /// At the first picture: at `p` (µm), with the row `j` (Q6) and its covariance `p_jj` (Q8);
    /// `variance` of the measurement, µm².
    pub(super) fn new(
        p: i32,
        j: [i32; 3],
        p_jj: [[i32; 3]; 3],
        variance: i32,
        noise: [i32; 3],
    ) -> Self {
        Self { p: p << 4, j, p_jj, p_pj: [0; 3], p_pp: variance, noise, scales: false }
    }

    /// The same where J goes with one over the ball's distance from something along this axis, as
    /// it does in height.
    pub(super) fn scaling(self) -> Self {
        Self { scales: true, ..self }
    }

    /// The motors turned by `d` (Q4 steps, 13 bits and a sign).
    pub(super) fn turned(&mut self, d: [i32; 3]) {
        if d.iter().any(|d| d.abs() >= FAR) {
            (self.p_pp, self.p_pj) = (P_PP_MAX as i32, [0; 3]);
            return;
        }
        let d = d.map(i64::from);
        // Bits: 19 + 13 = 32, 34 the sum; Q10 to Q4.
        let moved: i64 = (0..3).map(|k| times(self.j[k].into(), d[k])).sum::<i64>() >> 6;
        self.p = self.p.saturating_add(moved as i32);
        // P_JJ d, bits: 30 + 13 = 43, 45 the sum; Q12 to Q4 and within 30 bits.
        let spread = [0, 1, 2].map(|k| {
            let sum: i64 = (0..3).map(|l| times(self.p_jj[k][l].into(), d[l])).sum();
            (sum >> 8).clamp(-P_PJ_MAX, P_PJ_MAX)
        });
        // P_pp + 2 d'P_pJ + d'P_JJ d, bits: 31 + 13 = 44, 46 the sum; Q8 to Q0.
        let grown: i64 =
            (0..3).map(|k| times(d[k], 2 * i64::from(self.p_pj[k]) + spread[k])).sum::<i64>() >> 8;
        // (0.02 J d)², bits: 22 + 22; Q8; /2500.
        let jump = moved.clamp(-(1 << 22), 1 << 22);
        let bent = times(jump, jump) / (2500 * 256);
        let p_pp = (i64::from(self.p_pp) + grown + bent + WANDER).max(1);
        // Where P_pp saturates, P_pJ shrinks with it: the gains stay as they were, and P positive
        // definite. Q16.
        let kept = if p_pp > P_PP_MAX { (P_PP_MAX << 16) / p_pp } else { 1 << 16 };
        self.p_pp = p_pp.min(P_PP_MAX) as i32;
        for k in 0..3 {
            // Bits: 31 + 16.
            let sum = times(i64::from(self.p_pj[k]) + spread[k], kept);
            self.p_pj[k] = fit(sum >> 16, P_PJ_MAX);
        }
        self.drift(d);
        if self.scales {
            self.scale(bent);
        }
    }

    /// P_JJ grows by (0.01 max|J|)² for each step that any motor turned.
    fn drift(&mut self, d: [i64; 3]) {
        let largest = self.j.iter().map(|j| i64::from(j.abs())).max().unwrap_or(0);
        let turned: i64 = d.iter().map(|d| d.abs()).sum();
        // Bits: (19 + 19) - 12 = 26, times 15 is 41, Q4; /10^4 and to Q8.
        let growth = times(times(largest, largest) >> 12, turned * 16) / 10_000;
        for k in 0..3 {
            // Bits: at most 32 + 9.
            let own = times(growth, self.noise[k].into()) >> 8;
            self.p_jj[k][k] = (i64::from(self.p_jj[k][k]) + own).min(P_JJ_MAX) as i32;
        }
    }

    /// P_JJ grows by J J' (moved / 102 mm)², where `bent` is (moved / 50)² in µm²: entries that
    /// grow together. Not where that would not fit: cut off, P_JJ would not be positive definite
    /// any more.
    fn scale(&mut self, bent: i64) {
        // Q16; at most a half of J.
        let part = (bent >> 6).min(1 << 14);
        let j = self.j.map(i64::from);
        // Bits: 38 - 12 + 15; Q12 to Q0, and Q16 to Q8.
        let grown = |k: usize, l: usize| {
            i64::from(self.p_jj[k][l]) + (times(times(j[k], j[l]) >> 12, part) >> 8)
        };
        let diagonal = [0, 1, 2].map(|k| grown(k, k));
        if diagonal.iter().all(|&p| p <= P_JJ_MAX) {
            let [[ab, ac], [_, bc]] = [0, 1].map(|k| [1, 2].map(|l| grown(k, l)));
            let [aa, bb, cc] = diagonal;
            self.p_jj = [[aa, ab, ac], [ab, bb, bc], [ac, bc, cc]].map(|row| row.map(|p| p as i32));
        }
    }

    /// Takes in a measurement `z`, µm, of this variance (µm², 30 bits); what is farther off than 4
    /// standard deviations counts as so far off.
    pub(super) fn measured(&mut self, z: i32, variance: i32) {
        let measured = self.compared(z, variance.into());
        self.learn(&measured);
        self.place(&measured);
    }

    /// The same of a ball that is held for the `n`th picture: it hardly moves but by its law's
    /// answers to noise, of which J is not to learn. J is as well known after it as before.
    pub(super) fn held(&mut self, z: i32, variance: i32, n: u8) {
        let times_more = (1 << HELD_BITS) + i64::from(n.min(HELD_MOST));
        let measured = self.compared(z, times(variance.into(), times_more) >> HELD_BITS);
        self.place(&measured);
    }

    /// A measurement `z`, µm, of this variance (µm², 33 bits), beside what was expected.
    fn compared(&self, z: i32, variance: i64) -> Measured {
        let s = i64::from(self.p_pp) + variance;
        // Q4: 17 bits of the root, 2 of the 4, 4 of the format.
        let most = (s.unsigned_abs().isqrt() << 6) as i64;
        let innovation = ((i64::from(z) << 4) - i64::from(self.p)).clamp(-most, most);
        // Bits: 30 + 16.
        Measured { s, innovation, k_p: (i64::from(self.p_pp) << 16) / s }
    }

    /// What the measurement says of J.
    fn learn(&mut self, &Measured { s, innovation, .. }: &Measured) {
        // Bits: 30 + 16.
        let k_j = self.p_pj.map(|c| (i64::from(c) << 16) / s);
        let p_pj = self.p_pj.map(i64::from);
        for k in 0..3 {
            // Bits: K_J |innovation| <= 4 sd(J), 11 + 2 + 24 = 37; Q24 to Q6.
            self.j[k] = fit(i64::from(self.j[k]) + (times(k_j[k], innovation) >> 18), J_MAX);
            for l in 0..3 {
                // Bits: K_J P_pJ <= P_JJ by Cauchy and Schwarz, 30 + 16 = 46; Q24 to Q8. The same
                // both ways round, so that P stays symmetric.
                let less = times(k_j[k.min(l)], p_pj[k.max(l)]) >> 16;
                let least = if k == l { 1 } else { -P_JJ_MAX };
                self.p_jj[k][l] = (i64::from(self.p_jj[k][l]) - less).clamp(least, P_JJ_MAX) as i32;
            }
        }
    }

    /// What it says of where the ball is.
    fn place(&mut self, &Measured { innovation, k_p, .. }: &Measured) {
        // Bits: 16 + 23.
        self.p = self.p.saturating_add((times(k_p, innovation) >> 16) as i32);
        // Bits: 16 + 30, both.
        self.p_pj = self.p_pj.map(|c| fit(i64::from(c) - (times(k_p, c.into()) >> 16), P_PJ_MAX));
        let p_pp = i64::from(self.p_pp);
        self.p_pp = (p_pp - (times(k_p, p_pp) >> 16)).max(1) as i32;
    }

    /// The variance of J·n, quarters of µm², for `n` motor steps (at most 13 bits and a sign): 50
    /// bits.
    pub(super) fn variance_of(&self, n: [i32; 3]) -> u64 {
        let n = n.map(i64::from);
        // n'P n: bits 30 + 13 = 43, 45 the sum; Q8, 10 bits less, 35; times 13 is 48, the sum of
        // three.
        let square: i64 = (0..3)
            .map(|k| {
                times(n[k], (0..3).map(|l| times(self.p_jj[k][l].into(), n[l])).sum::<i64>() >> 10)
            })
            .sum();
        // What rounding leaves below zero is zero.
        square.max(0).unsigned_abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows that nearly fill their format, of a ball that is moved as far as it goes and back.
    #[test]
    fn the_covariance_stays_one_where_it_does_not_fit() {
        let j = [-300_000, -40_000, -170_000];
        let p_jj = [0, 1, 2].map(|k| [0, 1, 2].map(|l| if k == l { 1 << 29 } else { 0 }));
        let mut axis = Axis::new(0, j, p_jj, 1_000_000, [256; 3]).scaling();
        for k in 0..200 {
            let way = if k / 20 % 2 == 0 { 40 } else { -40 };
            axis.turned([way, way / 2, way * (k % 3)]);
            axis.measured((axis.p >> 4) + 500 * (k % 5 - 2), 1_000_000);
            for (k, l) in [(0, 1), (0, 2), (1, 2)] {
                let [kl, kk, ll] =
                    [(k, l), (k, k), (l, l)].map(|(k, l)| f64::from(axis.p_jj[k][l]));
                // Rounding apart.
                assert!(kl * kl <= kk * ll * 1.001 + 1e6, "{:?}", axis.p_jj);
            }
        }
    }
}
